#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "apps/view/drawing/picture_images.h"
#include "apps/view/window/panel.h"
#include "engine/base/wake.h"
#include "engine/gpu/device.h"
#include "engine/program/render_picture.h"
#include "engine/render/interactive.h"
#include "engine/render/renderer.h"
#include "engine/session/session.h"

namespace palpate::view {

// Makes the pictures of views from a session's newest snapshot.
//
// With a thread, pictures are made one after the other and the interface waits for none. Slices are
// made together, and take turns with the volume. Of an edit they draw the pixels in which it can be
// seen, and a slice that it does not reach is not drawn. The volume is drawn from fewer rays while
// anything but its samples and the places of opaque meshes changes: within frame_ms, or 1.7 times
// as long where the picture would err by more than kAim else; and within half of it while slices
// change, too. When all views show what they shall, it is refined by rows. Of an edit, and of a
// mesh that moves, the pixels that change are drawn anew at full quality, and the others stay, or
// are refined in the time left. Wishes and edits that come meanwhile are looked at every kLook_ms;
// a picture that takes several parts of an atlas is given up for them.
class Pictures {
 public:
    struct Options {
        RendererOptions renderer; // its progress is asked of pictures in parts, on the thread
        double frame_ms = 60.0;
        std::vector<std::shared_ptr<const Mesh>> meshes; // of the session's scene
        std::optional<Volume> fused, overlay;            // SceneData
        std::function<void()> on_picture;                // called on the thread
        bool threaded = true;
        bool stay = false; // on the device, which is the interface's, too
    };
    // The picture that a view shall show. Scenes are those of scene_of(), with surfaces behind
    // theirs for what is no part of the document: `meshes`, one each.
    struct Wish {
        Panel panel;
        Scene scene;
        DisplayLayout display; // both eyes as one picture, and marks over them
        std::vector<std::shared_ptr<const Mesh>> meshes{};

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
    // A picture of a wish for print, with marks, in a file. The thread writes it between two
    // pictures of views; one at a time.
    struct Print {
        Wish wish;
        PictureLook look;
        std::filesystem::path path; // .png
        // Called on the thread, with the outcome; not where the thread ends before.
        std::function<void(Result<void>)> done;
    };
    void print(Print print);
    // Why the thread has ended, if it has; for lack of memory, others may be made in its place.
    struct Failure {
        std::string why;
        bool for_lack_of_memory = false;
    };
    std::optional<Failure> failure();

 private:
    // RMSE of colours: 40 dB below white.
    static constexpr double kAim = 0.01;
    static constexpr double kLook_ms = 12.0;

    struct Made { // a picture of the thread's
        Scene scene;
        DisplayLayout display;
        std::vector<std::shared_ptr<const Mesh>> meshes;
        Volume volume; // that it shows
        std::optional<Volume> labels, fused, overlay;
        bool complete = false;

        static bool are_same(const std::optional<Volume>& a, const std::optional<Volume>& b) {
            return a.has_value() == b.has_value() && (!a || a->is_same_as(*b));
        }
        bool has_scene_of(const Made& other) const { // but for where the meshes are
            return scene == other.scene && meshes.size() == other.meshes.size() &&
                   labels.has_value() == other.labels.has_value() &&
                   overlay.has_value() == other.overlay.has_value() && are_same(fused, other.fused);
        }
        bool has_rays_of(const Made& other) const {
            return has_scene_of(other) && meshes == other.meshes &&
                   volume.is_same_as(other.volume) && are_same(labels, other.labels) &&
                   are_same(overlay, other.overlay);
        }
        // The box in which the two differ, if they have one scene.
        std::optional<PixelBox> pixels_changed_to(const Made& other) const;
    };
    struct Drawn { // a wish, and which of its pixels
        const Wish* wish;
        std::optional<PixelBox> changed; // none: all
    };
    using Wishes = std::vector<Drawn>;
    void run(const std::stop_token& stop);
    Result<void> draw_print(const Print& print);
    bool go_on(const std::vector<Wish>& wishes); // false: there was nothing to do
    void keep(const Wish& wish, Picture picture);
    const std::optional<Volume>& fused() const; // of the session, else of the file
    const std::optional<Volume>& overlay() const;
    SceneData data_for(const Wish& wish, const Scene& scene) const;
    Made made_of(const Wish& wish) const;
    Renderer& renderer_of(Panel panel);
    Result<std::vector<Picture>> draw_full(const Wishes& wishes);
    Result<std::optional<Picture>> draw_volume(const Wish& wish, double budget_ms);
    bool is_outdated();

    Wake wake_; // of the thread, for wishes and edits
    Session::Eye eye_;
    Options options_;
    bool stopping_at_wishes_ = false; // before the renderer that asks it
    Renderer volume_;
    std::array<Renderer, kSlicePanels> slices_; // share what lies on the device with it
    PictureImages images_;

    // The thread's own.
    std::optional<Session::Eye::Sight> sight_;
    Interactive interactive_;
    bool coarse_ = true; // there are pictures of fewer rays
    std::array<std::optional<Made>, kPanels.size()> made_;
    bool volumes_turn_ = false;
    double last_error_ = 0;    // of the volume's picture
    uint64_t drawing_for_ = 0; // of wished_

    std::mutex mutex_; // of what follows
    std::vector<Wish> wishes_;
    uint64_t wished_ = 0;
    std::array<std::optional<Picture>, kPanels.size()> done_;
    std::optional<Print> print_;
    std::optional<Failure> failure_;

    std::jthread thread_; // last: ends before the rest goes
};

} // namespace palpate::view
