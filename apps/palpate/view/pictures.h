#pragma once

#include <array>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "apps/palpate/view/panel.h"
#include "engine/gpu/device.h"
#include "engine/render/interactive.h"
#include "engine/render/renderer.h"
#include "engine/session/session.h"

namespace palpate::view {

// A view's picture: 4 bytes a pixel (R, G, B, A), row 0 at the top.
struct Picture {
    Panel panel = Panel::axial;
    glm::uvec2 size_px{0};
    std::vector<std::byte> rgba;
    double ms = 0;             // that drawing it took
    double error_estimate = 0; // RMSE of colours, 1 is white; 0 when it is complete
    bool complete = true;
};

// Makes the pictures of views from a session's newest snapshot, on a device of its own.
//
// With a thread, pictures are made one after the other and the interface waits for none. The view
// that has waited longest comes first. Of the volume, coarse ones are made within frame_ms while
// anything changes; when all views show what they shall, it is refined by rows. A wish that comes
// meanwhile is looked at after each of these steps.
class Pictures {
 public:
    struct Options {
        RendererOptions renderer;
        double frame_ms = 60.0;
        std::vector<std::shared_ptr<const Mesh>> meshes; // of the session's scene
        std::function<void()> on_picture;                // called on the thread
        bool threaded = true;
    };
    // What a view shall show. Scenes are those of scene_of().
    struct Wish {
        Panel panel;
        Scene scene;

        friend bool operator==(const Wish&, const Wish&) = default;
    };

    Pictures(GpuDevice& device, Session& session, Options options);
    ~Pictures();
    Pictures(const Pictures&) = delete;
    Pictures& operator=(const Pictures&) = delete;

    void want(std::vector<Wish> wishes); // never waits for a picture
    std::vector<Picture> take();         // those made since the last call, at most one a panel
    // Without a thread: all wishes at full quality, now.
    Result<std::vector<Picture>> draw();
    // Why the thread has ended, if it has.
    std::optional<std::string> failure();

 private:
    struct Made { // a picture of the thread's
        Scene scene;
        uint64_t volume = 0, labels = 0; // versions of what it shows
        bool complete = false;

        friend bool operator==(const Made&, const Made&) = default;
    };
    void run(const std::stop_token& stop);
    bool go_on(const std::vector<Wish>& wishes); // false: there was nothing to do
    void hand_over(Picture picture);
    SceneData data_for(const Scene& scene) const;
    Made made_of(const Wish& wish) const;
    Renderer& renderer_of(Panel panel);
    Result<Picture> draw_full(const Wish& wish);
    Result<Picture> draw_volume(const Wish& wish);

    Session::Eye eye_;
    Options options_;
    Renderer volume_;
    std::array<Renderer, kSlicePanels> slices_; // share what lies on the device with it

    // The thread's own.
    std::optional<Session::Eye::Sight> sight_;
    Interactive interactive_;
    bool coarse_ = true; // there are pictures of fewer rays
    std::array<std::optional<Made>, kPanels.size()> made_;
    std::array<uint64_t, kPanels.size()> turns_{}; // when each was drawn last
    uint64_t turn_ = 0;

    std::mutex mutex_; // of what follows
    std::condition_variable_any wake_;
    std::vector<Wish> wishes_;
    uint64_t wished_ = 0;
    std::array<std::optional<Picture>, kPanels.size()> done_;
    std::optional<std::string> failure_;

    std::jthread thread_; // last: ends before the rest goes
};

} // namespace palpate::view
