// Scripts that name places: what a person did in one window is done again in windows of other
// sizes, layouts and letters.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <random>

#include "apps/view/window/replay.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

using ::testing::HasSubstr;

class Replay : public ViewerTest {
 protected:
    // What a person does next, recorded.
    void record_in(glm::uvec2 size) {
        open("synthetic:phantom?size=32", size);
        recorder_.emplace(path_, size, 1.0);
        frame_ = 0;
    }
    void act(Event event) {
        event.time_s = time_s_ += 0.5;
        recorder_->add(++frame_, {event}, viewer());
        viewer().frame({event}, event.time_s);
        viewer().frame({}, event.time_s + 0.25);
    }
    void act_move(glm::dvec2 at, Modifiers held = {}) {
        act({.kind = Event::Kind::move, .modifiers = held, .at_px = at});
    }
    void act_button(bool down) { act({.kind = Event::Kind::button, .down = down}); }
    void act_key(const std::string& name) {
        for (const bool down : {true, false})
            act({.kind = Event::Kind::key, .down = down, .key = name});
    }
    void act_click(const std::string& widget, glm::dvec2 share) {
        const Box box = viewer().interface().widgets().at(widget);
        act_move(glm::dvec2(box.low_px) + glm::floor(share * glm::dvec2(box.size_px)));
        act_button(true);
        act_button(false);
    }
    nlohmann::json state_json() { return nlohmann::json::parse(json_line(viewer().dump())); }

    Result<void> replay_in(glm::uvec2 size, double text_scale) {
        const Script script = load_script(path_).value();
        open_scene(Source{open_synthetic("synthetic:phantom?size=32")}, size, {}, {}, text_scale);
        return replay(viewer(), script);
    }
    Result<void> do_lines(const std::string& lines) {
        open("synthetic:phantom?size=32", {800, 600});
        return replay(viewer(), parse_script("{\"palpate_view\": 2}\n" + lines, "s.jsonl").value());
    }

    ~Replay() override { std::filesystem::remove(path_); }
    const std::filesystem::path path_ =
        std::filesystem::temp_directory_path() / fmt::format("palpate.Replay.{}.jsonl", ::getpid());
    std::optional<Recorder> recorder_;
    uint64_t frame_ = 0;
    double time_s_ = 1.0;
};

// A brush of 20 mm ends where its pointer was in the patient: to 1/512 px of the first window, that
// is 0.002 mm, in which no sample of 6.5 mm lies for these places; measures agree to that, too.
TEST_F(Replay, InAnotherWindowChangesTheSameSamplesAndMeasuresTheSame) {
    record_in({800, 600});
    act_key("b");
    act_move(middle(Panel::axial) + glm::dvec2(-31, 12));
    act_button(true);
    act_move(middle(Panel::axial) + glm::dvec2(27, 40));
    act_button(false);
    act_key("x");
    act_move(middle(Panel::sagittal) + glm::dvec2(11, -17));
    act_button(true);
    act_button(false);
    act_click("tool/erase", {0.5, 0.5});
    act_move(middle(Panel::coronal) + glm::dvec2(3, 5));
    act_button(true);
    act_move(middle(Panel::coronal) + glm::dvec2(300, 5)); // beyond its view
    act_button(false);
    act_click("window/2", {0.3, 0.5});
    act_key("m");
    act_move(middle(Panel::axial) + glm::dvec2(-40, -40));
    act_button(true);
    act_move(middle(Panel::axial) + glm::dvec2(40, 20));
    act_button(false);
    const nlohmann::json first = state_json();
    ASSERT_EQ(first["undo_steps"], 4) << first["message"];
    struct Other {
        glm::uvec2 size;
        double text_scale;
    };
    for (const auto& [size, text_scale] :
         {Other{{800, 600}, 1.0}, Other{{1280, 800}, 1.0}, Other{{1440, 1100}, 1.5}}) {
        SCOPED_TRACE(size.x);
        const Result<void> done = replay_in(size, text_scale);
        ASSERT_TRUE(done) << done.error().message;
        const nlohmann::json again = state_json();
        EXPECT_EQ(again["document"], first["document"]);
        EXPECT_EQ(again["undo_steps"], first["undo_steps"]);
        EXPECT_EQ(again["window"], first["window"]);
        ASSERT_EQ(again["measures"].size(), 1u);
        for (size_t end = 0; end < 2; ++end)
            for (size_t axis = 0; axis < 3; ++axis)
                EXPECT_NEAR(again["measures"][0]["points_mm"][end][axis].get<double>(),
                            first["measures"][0]["points_mm"][end][axis].get<double>(), 0.002);
    }
}

// Pixels of window systems are told by places without a rounded bit, in views that were moved, too.
TEST_F(Replay, APlaceOfAPixelIsThatPixel) {
    record_in({1013, 771});
    std::mt19937 random(7);
    Placing placing;
    for (int i = 0; i < 2000; ++i) {
        if (i % 100 == 0)
            act({.kind = Event::Kind::wheel,
                 .modifiers = {.ctrl = i % 200 == 0},
                 .wheel = {0.0, i % 300 == 0 ? 1.0 : -1.0}});
        const glm::dvec2 at = glm::dvec2(random() % (256 * 1013), random() % (256 * 771)) / 256.0;
        move(at);
        const Event event{.kind = Event::Kind::move, .at_px = at};
        const Shown shown{&state(), &viewer().interface().widgets(), &grid()};
        const Place place = placing.place_of(event, shown);
        if (!std::holds_alternative<std::monostate>(place)) {
            EXPECT_EQ(pixel_of(place, shown), at) << name_of(place);
        }
    }
}

TEST_F(Replay, SamplesAndMillimetresAreFound) {
    const Result<void> done =
        do_lines(R"({"frame": 1, "move": {"view": "axial", "sample": [20, 9, 3]}}
{"frame": 2, "button": "left", "down": true}
{"frame": 3, "button": "left"})");
    ASSERT_TRUE(done) << done.error().message;
    // The slice keeps its layer, 16 of 32: the point is seen along the slice's axis.
    EXPECT_EQ(state_json()["crosshair_sample"], nlohmann::json({20, 9, 16}));
    const glm::dvec3 point_mm = world_point(grid(), {7, 16, 25});
    const Result<void> by_mm =
        do_lines(fmt::format(R"({{"frame": 1, "move": {{"view": "coronal", "mm": [{}, {}, {}]}}}}
{{"frame": 2, "button": "left", "down": true}}
{{"frame": 3, "button": "left"}})",
                             point_mm.x, point_mm.y, point_mm.z));
    ASSERT_TRUE(by_mm) << by_mm.error().message;
    EXPECT_EQ(state_json()["crosshair_sample"], nlohmann::json({7, 16, 25}));
}

TEST_F(Replay, APressOnWhatIsNotShownIsAnErrorAMoveIsNot) {
    const std::string to = R"({"frame": 4, "move": {"widget": "clip/add", "share": [0.5, 0.5]}})";
    EXPECT_TRUE(do_lines(to));
    const Result<void> pressed =
        do_lines(to + "\n{\"frame\": 6, \"button\": \"left\", \"down\": true}");
    ASSERT_FALSE(pressed);
    EXPECT_EQ(pressed.error().message,
              "s.jsonl: frame 6: expected widget 'clip/add' to be shown where a button is pressed");
    const Result<void> alone =
        do_lines(R"({"frame": 1, "move": {"view": "axial", "share": [0.5, 0.5]}}
{"frame": 2, "key": "f", "down": true}
{"frame": 3, "key": "f"}
{"frame": 8, "move": {"view": "3d", "share": [0.5, 0.5]}}
{"frame": 9, "wheel": [0, 1]})");
    ASSERT_FALSE(alone);
    EXPECT_THAT(alone.error().message, HasSubstr("frame 9: expected view '3d' to be shown"));
}

// A press at a place that is scrolled out of its panel would be for another widget, or for none.
TEST_F(Replay, APressOnWhatIsScrolledOutOfViewIsAnError) {
    const std::string press =
        R"({"frame": 40, "move": {"widget": "slices/open", "share": [0.5, 0.5]}}
{"frame": 44, "button": "left", "down": true}
{"frame": 48, "button": "left"})";
    const auto in_low_window = [&](const std::string& lines) {
        open_window(Source{open_synthetic("synthetic:phantom?size=32")}, {800, 400});
        return replay(viewer(), parse_script("{\"palpate_view\": 2}\n" + lines, "s.jsonl").value());
    };
    const Result<void> pressed = in_low_window(press);
    ASSERT_FALSE(pressed);
    EXPECT_EQ(pressed.error().message,
              "s.jsonl: frame 44: expected widget 'slices/open', which is scrolled out of view, to "
              "be seen where a button is pressed");
    const Result<void> scrolled = in_low_window(
        R"({"frame": 4, "move": {"widget": "window/1", "share": [0.5, 0.5]}}
{"frame": 8, "wheel": [0, -100]}
)" + press);
    ASSERT_TRUE(scrolled) << scrolled.error().message;
    EXPECT_TRUE(state().browser_open);
}

} // namespace
} // namespace palpate::view
