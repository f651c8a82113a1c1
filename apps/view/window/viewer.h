#pragma once

#include <atomic>
#include <functional>
#include <future>
#include <memory>
#include <string>

#include "apps/view/drawing/pictures.h"
#include "apps/view/drawing/ui_drawing.h"
#include "apps/view/panels/interface.h"
#include "apps/view/panels/welcome.h"
#include "apps/view/script/script.h"
#include "apps/view/window/file_opening.h"
#include "apps/view/window/settings.h"
#include "engine/base/json.h"
#include "engine/image/image.h"
#include "engine/io/volume_io.h"

namespace palpate::view {

// Options that views and pictures are made with.
struct ViewerOptions {
    RendererOptions renderer;
    double frame_ms = 60.0; // of coarse pictures of the volume
    bool threaded = true;   // false: for scripts, whose result is a function of their input
    std::optional<DisplayProfile> display{}; // of a stereo screen
    bool volume_alone = false;               // begins with nothing but the volume's view
    // Opens another file by its name, for files that are dropped on the window.
    // From a thread of its own, where threaded. `series`: of a DICOM folder; empty: the largest.
    std::function<Result<Source>(const std::string& path, const std::string& series,
                                 const std::stop_token& stop,
                                 const std::function<void(double share)>& progress)>
        open;
    // Reads a label map, or another volume, for the one that is open.
    std::function<Result<LoadedVolume>(const std::string& path, bool labels,
                                       const std::stop_token& stop,
                                       const std::function<void(double share)>& progress)>
        open_beside{};
    SeriesPreviews::Read preview{}; // of a DICOM folder; empty: its series have no pictures
    // What was opened last, and a word to it that `path` has been opened; may be empty.
    std::function<std::vector<std::string>(const std::string& path)> recent;
    bool asks_for_file = false; // what is open at first is there to try: others are offered
    // A picture of SeriesPreviews::kSide_px of what is offered: of a file that was opened before,
    // or of a synthetic volume. And a word to it that this is the picture of a file; may be empty.
    std::function<Result<std::vector<std::byte>>(const std::string& path)> small_picture{};
    std::function<void(const std::string& path, const std::vector<std::byte>& rgba)>
        keep_small_picture{};
    bool hints = false;  // shows those of the first start, if they have not been seen
    Settings settings{}; // as they were kept; the text scale is given beside them
    // What a person has changed; may be empty.
    std::function<void(const Settings&)> keep_settings{};
    std::function<void()> on_picture;
    HandOptions hand; // where it names a device, that is started, without force
};

// The program without its window: a frame takes events, changes the state and the document, and
// lays out the interface. Drawing it on an image is another step.
class Viewer {
 public:
    // `pictures` draws volumes, `interface` what is shown; both may be one where nothing is
    // threaded. Where they are one Vulkan device, pictures do not leave it.
    Viewer(GpuDevice& pictures, GpuDevice& interface, VkFormat format, Source source,
           glm::uvec2 size_px, double text_scale, ViewerOptions options);

    ~Viewer();

    void frame(std::vector<Event> events, double time_s);

    // Draws the interface on a target of the format, with the newest pictures.
    void record(Commands& commands, UiTarget& target);

    // Without a thread: all pictures at full quality, drawn by the next record().
    Result<void> draw_pictures();
    // The window as an image; without a thread, at full quality.
    Result<Image> shot();
    // The window as it is now.
    Image capture();

    // The next record() draws all of the window, not only what has changed.
    void forget_drawing() { drawing_->forget(); }

    // Rises when what record() draws is another than before.
    uint64_t looks();

    const ViewState& state() const { return state_; }
    Work& work() { return *work_; }
    const Grid& grid() const { return work_->subject().grid; }
    const Interface& interface() const { return *interface_; }
    Json dump();
    // The last order about scripts since this was asked: for a window, which does it.
    std::optional<ScriptOrder> take_script_order() { return std::exchange(script_order_, {}); }
    void show_scripts(Scripting scripts) { state_.scripts = std::move(scripts); }
    // Why no pictures can be drawn any more.
    std::optional<std::string> failure();
    std::string title() const { return state_.names_hidden ? "" : work_->title(); }
    // The window's first pixel is here on the screen: interleaved layouts count from there.
    void set_place(glm::ivec2 screen_px) { screen_px_ = screen_px; }
    // A 3D cursor stands in for the pointer.
    bool hides_pointer() const { return state_.cursor_mm && state_.under == Panel::volume; }
    // Every picture that frame() takes, for measurements.
    std::function<void(const Picture&)> saw_picture{};
    // The window is to close: it was asked to, and no edits are lost that a person wants to keep.
    bool is_done() const { return done_; }

 private:
    void open(const std::string& path, const std::string& series);
    void open_last();
    void open_beside(const std::string& path, bool labels);
    void show_opening(const std::string& path);
    bool may_open(); // else a person is told why not
    void tell_unopened(const Error& error);
    // Closes or opens where no edits are lost; else a person is asked first.
    void ask_to_leave(Leaving leaving);
    void leave();
    void save(const order::Save& order);
    void ask_where_again();
    void leave_when_saved();
    void take_opened(Result<Source> opened);
    void ask_about(Source label_map, const std::string& path);
    void show_opened(Source source, const std::string& path);
    void forget_label_map(); // about which a person was asked
    void take_beside(Result<FileBeside> opened);
    void show_fused(LoadedVolume opened);
    void poll_opening();
    void follow_previews();
    void follow_file_preview();
    void offer_files();
    void follow_text_scale();
    void keep_settings();
    void save_picture();
    void keep_small_picture(const std::string& path); // of the volume, for lists of files
    void print_figure(const std::string& file);
    void follow_figure();          // how far it is, and that it is written
    void end_figure();             // stops what is being drawn, and waits for it
    std::string file_name() const; // of pictures
    void begin(Source source);
    // Does a part of a frame; where it throws, a person is told what failed and why. Errors of the
    // device are passed on.
    template <class Do>
    bool attempt_part(const std::string& what, Do&& act);
    bool has_all(); // that a frame needs: what could not be made before is made
    void obey(const Order& order, bool& wants_picture);
    void take_pictures();
    void follow_work(); // what the document has come to
    void drop_pictures();
    void make_pictures(); // of the session's; the textures are there when they are
    void wish();
    void note_wish(const Scene& scene);

    GpuDevice *pictures_device_, *interface_device_;
    VkFormat format_;
    ViewerOptions options_;
    std::unique_ptr<Interface> interface_;
    std::unique_ptr<UiDrawing> drawing_;
    std::unique_ptr<Work> work_;
    Pictures::Options pictures_with_;
    std::unique_ptr<Pictures> pictures_;
    ViewState state_;
    double time_s_ = 0;        // of the last frame
    bool over_widget_ = false; // the pointer was, at its last move
    glm::ivec2 screen_px_{0};
    std::vector<Picture> new_pictures_;
    UiTiles tiles_seen_; // by looks()
    uint64_t looks_ = 0;
    std::array<PictureState, kPanels.size()> state_of_pictures_{};
    Scene volume_wished_;                    // of the 3D view, without its camera
    std::optional<double> volume_waits_s_{}; // since when no picture of it has come
    double interface_scale_ = 1.0;           // that interface_ is made for
    Settings kept_;                          // as they were given or kept last
    double liked_scale_ = 0.0;               // of texts, that a person has chosen; 0: none
    std::string last_failure_;               // of a part of a frame, and when it was
    double failed_s_ = -1e9;
    Message saved_; // told with the next document: where the one before it was saved
    double pictures_failed_s_ = -1e9; // when memory for pictures had run out
    bool done_ = false;
    std::optional<ScriptOrder> script_order_;
    std::unique_ptr<SeriesPreviews> previews_;
    bool new_previews_ = false; // since record()
    Welcome welcome_;
    bool new_welcome_ = false; // since record()
    FilePreview file_preview_;
    bool new_file_preview_ = false; // since record()
    struct FigureRun {
        std::stop_source stop;
        std::atomic<uint32_t> drawn{0};
        uint32_t pictures = 1;
        std::function<void()> on_drawn;       // may be empty
        std::future<Result<Message>> written; // what is told
    };
    std::unique_ptr<FigureRun> figure_;
    bool shows_example_ = false;      // what is open is there to try, and nothing lies over it
    std::optional<Source> label_map_; // waits for a person to say what becomes of it
    FileOpening opening_;             // last: its threads end before the rest goes
};

} // namespace palpate::view
