#pragma once

#include <gtest/gtest.h>

#include "apps/view/tools/tool.h"
#include "apps/view/window/loop.h"
#include "engine/session/default_scene.h"
#include "tests/support/kept_device.h"
#include "tests/view/bars.h"

namespace palpate::view {

inline Result<OpenedScene> try_synthetic(const std::string& name) {
    SceneFile file;
    file.volume = name;
    PALPATE_TRY(LoadedScene loaded, load_scene_data(file));
    Scene scene;
    scene.size_px = {400, 300};
    scene.ray_cast = default_ray_cast(RayMode::alpha, loaded);
    scene.camera = default_camera(scene, loaded.data);
    return OpenedScene{std::move(file), std::move(loaded), std::move(scene)};
}
inline OpenedScene open_synthetic(const std::string& name) {
    return try_synthetic(name).value();
}

// The program without a window, and a hand. One device with validation for all tests of a program;
// a message fails the test that caused it.
class ViewerTest : public ::testing::Test {
 protected:
    static GpuDevice& device() {
        static KeptForTests<GpuDevice>& kept = keep_device(headless_device("", true));
        return kept.get();
    }
    void SetUp() override { messages_before_ = device().validation_messages().size(); }
    void TearDown() override {
        viewer_.reset();
        const auto messages = device().validation_messages();
        for (size_t i = messages_before_; i < messages.size(); ++i)
            ADD_FAILURE() << messages[i];
    }
    void open(const std::string& name = "synthetic:phantom?size=40", glm::uvec2 size = {800, 600},
              HandOptions hand = {}) {
        open_scene(Source{open_synthetic(name)}, size, {}, std::move(hand));
    }
    // In a window that is larger by its bars.
    void open_scene(Source source, glm::uvec2 size,
                    const std::optional<DisplayProfile>& display = {}, HandOptions hand = {},
                    double text_scale = 1.0) {
        open_window(std::move(source), with_bars(size, text_scale), display, std::move(hand),
                    text_scale);
    }
    // A window of exactly this size.
    void open_window(Source source, glm::uvec2 size,
                     const std::optional<DisplayProfile>& display = {}, HandOptions hand = {},
                     double text_scale = 1.0) {
        time_s_ = 1.0;
        ViewerOptions options{.threaded = false, .display = display};
        options.settings = settings_;
        options.hand = std::move(hand);
        options.open = [](const std::string& path, const std::string&, const std::stop_token&,
                          const std::function<void(double)>&) -> Result<Source> {
            if (!is_synthetic(path))
                return fail("{}: expected a synthetic volume", path);
            PALPATE_TRY(OpenedScene scene, try_synthetic(path));
            return Source{std::move(scene)};
        };
        options.preview = preview_;
        if (change_options_)
            change_options_(options);
        if (beside_)
            options.open_beside =
                [read = beside_](const std::string& path, bool labels, const std::stop_token&,
                                 const std::function<void(double)>&) { return read(path, labels); };
        viewer_.reset();
        viewer_.emplace(device(), device(), VK_FORMAT_R8G8B8A8_UNORM, std::move(source), size,
                        text_scale, std::move(options));
        frame({});
    }
    void set_options(std::function<void(ViewerOptions&)> change) { // before open()
        change_options_ = std::move(change);
    }
    void set_preview(SeriesPreviews::Read read) { preview_ = std::move(read); } // before open()
    void set_settings(const Settings& settings) { settings_ = settings; }       // before open()
    using ReadBeside = std::function<Result<LoadedVolume>(const std::string& path, bool labels)>;
    void set_beside(ReadBeside read) { beside_ = std::move(read); } // before open()
    std::function<void(bool begins)>
        at_frame_; // called before and after each frame, if there is one
    Viewer& viewer() { return *viewer_; }
    const ViewState& state() { return viewer_->state(); }
    const Grid& grid() { return viewer_->work().subject().grid; }
    void frame(std::vector<Event> events, double seconds = 0.4) { // clicks are single ones
        for (Event& event : events)
            event.time_s = time_s_;
        if (at_frame_)
            at_frame_(true);
        viewer_->frame(std::move(events), time_s_);
        if (at_frame_)
            at_frame_(false);
        time_s_ += seconds;
    }
    void move(glm::dvec2 to, Modifiers held = {}) {
        frame({{.kind = Event::Kind::move, .modifiers = held, .at_px = to}});
    }
    void button(bool down, Button which = Button::left, Modifiers held = {}) {
        frame({{.kind = Event::Kind::button, .modifiers = held, .button = which, .down = down}});
    }
    void click(glm::dvec2 at) {
        move(at);
        button(true);
        button(false);
        frame({});
    }
    void key(const std::string& name, Modifiers held = {}) {
        frame({{.kind = Event::Kind::key, .modifiers = held, .down = true, .key = name}});
        frame({{.kind = Event::Kind::key, .modifiers = held, .key = name}});
    }
    static bool is_of_the_top_bar(const std::string& id) {
        return id.starts_with("task") || id.starts_with("top/") || id.starts_with("panel/") ||
               id == "tool/undo" || id == "tool/redo" || id == "tool/save";
    }
    // Turns the wheel over the side panel, or that of touch, until a widget can be seen there.
    void reveal(const std::string& id) {
        const auto& widgets = viewer_->interface().widgets();
        for (int turns = 0; turns < 60 && widgets.count(id); ++turns) {
            const Box box = widgets.at(id);
            const Places places = places_of(state());
            if (box.low_px.x < places.bar.size_px.x || is_of_the_top_bar(id))
                return; // nothing of the bars is ever hidden
            const Box panel = places.tools.low_px.x <= box.low_px.x ? places.tools : places.touch;
            const int middle = box.low_px.y + box.size_px.y / 2;
            const double up = panel.low_px.y - middle,
                         down = middle - panel.low_px.y - panel.size_px.y;
            if (panel.size_px.y == 0 || (up <= 0.0 && down < 0.0))
                return;
            move(glm::dvec2(panel.low_px + panel.size_px / 2));
            frame({{.kind = Event::Kind::wheel, .wheel = {0.0, up > 0.0 ? 1.0 : -1.0}}});
            frame({});
        }
    }
    // By its word in the bar at the top, or from the list that a narrow bar has.
    void take_task(WindowTask task) {
        const std::string id = fmt::format("task/{}", name_of(task));
        if (!viewer_->interface().widgets().count(id)) {
            click_widget("task");
            frame({});
        }
        click_widget(id);
        frame({});
    }
    // Takes the task of a section of the side panel, and opens the section.
    void show(const std::string& name) {
        const SectionEntry* section = find_section(name);
        ASSERT_TRUE(section) << name;
        take_task(section->task);
        if (!is_shown(state(), section->section))
            click_widget("section/" + name);
        frame({});
    }
    void click_widget(const std::string& id, double across = 0.0) {
        const auto& widgets = viewer_->interface().widgets();
        ASSERT_TRUE(widgets.count(id)) << id;
        reveal(id);
        const Box box = widgets.at(id);
        click(glm::dvec2(box.low_px) +
              glm::dvec2(8.0 + across * (box.size_px.x - 16), 0.5 * box.size_px.y));
    }
    glm::dvec2 middle(Panel panel) {
        const Box box = box_of(state(), panel).value();
        return glm::floor(glm::dvec2(box.low_px) + 0.5 * glm::dvec2(box.size_px));
    }
    // A name of a label, as the list of labels gives it.
    void note_name(uint32_t label, const std::string& name) {
        Session& session = viewer_->work().session();
        const NotePages before = session.state().document.notes;
        Notes notes = notes_of(before).value();
        name_label(notes, label, name);
        session.note(changes_between(before, pages_of(notes)), "label names");
        frame({});
        frame({});
    }
    const Volume* volume(const char* name) {
        state_ = viewer_->work().edited();
        return state_->document.find(name);
    }

 private:
    std::optional<Viewer> viewer_;
    SeriesPreviews::Read preview_;
    std::function<void(ViewerOptions&)> change_options_;
    Settings settings_;
    ReadBeside beside_;
    std::optional<EditState> state_;
    double time_s_ = 1.0;
    size_t messages_before_ = 0;
};

} // namespace palpate::view
