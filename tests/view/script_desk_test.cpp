// Scripts in a window: played at any speed, handed over, and recorded.

#include "apps/view/window/script_desk.h"

#include <filesystem>

#include "engine/base/file.h"
#include "engine/volume/content_hash.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

// A stroke of the tool that cuts, with a pause of 1 s before it, and then a key.
constexpr const char* kStroke = R"({"palpate_view": 2, "size": [800, 600], "text_scale": 1}
{"frame": 10, "t_s": 5.0, "key": "x", "down": true}
{"frame": 11, "t_s": 5.1, "key": "x"}
{"frame": 70, "t_s": 6.1, "move": {"view": "axial", "share": [0.5, 0.6]}}
{"frame": 71, "t_s": 6.2, "button": "left", "down": true}
{"frame": 72, "t_s": 6.3, "move": {"view": "axial", "share": [0.6, 0.6]}}
{"frame": 73, "t_s": 6.4, "button": "left", "down": false}
{"frame": 74, "t_s": 6.5, "key": "home", "down": true}
{"frame": 75, "t_s": 6.6, "key": "home"}
)";

class ScriptDeskTest : public ViewerTest {
 protected:
    void SetUp() override {
        ViewerTest::SetUp();
        open("synthetic:phantom?size=24");
    }
    void turn(ScriptDesk& desk, std::vector<Event> person = {}) {
        std::vector<Event> events = desk.take(frame_++, std::move(person), window_s_, viewer());
        EXPECT_GE(desk.time_s(), last_s_);
        last_s_ = desk.time_s();
        viewer().frame(std::move(events), desk.time_s());
        window_s_ += 1.0 / 60.0;
    }
    // Frames until it ends.
    int play(ScriptDesk& desk, double speed) {
        desk.play(parse_script(kStroke, "stroke.jsonl").value(), speed);
        int frames = 0;
        for (; desk.is_playing() && frames < 1000; ++frames)
            turn(desk);
        turn(desk);
        return frames;
    }
    uint64_t cut_hash() { return content_hash(*volume(Work::kGrey)); }

    uint64_t frame_ = 0;
    double window_s_ = 2.0, last_s_ = 0.0;
};

TEST_F(ScriptDeskTest, AnySpeedGivesTheSameSamples) {
    ASSERT_TRUE(replay(viewer(), parse_script(kStroke, "stroke.jsonl").value()));
    const uint64_t expected = cut_hash();
    std::vector<int> frames;
    for (const double speed : {1.0, 4.0, 1000.0}) {
        open("synthetic:phantom?size=24");
        ASSERT_NE(cut_hash(), expected);
        window_s_ = 2.0;
        last_s_ = 0.0;
        ScriptDesk desk("", {800, 600}, 1.0);
        frames.push_back(play(desk, speed));
        EXPECT_EQ(cut_hash(), expected) << speed;
        EXPECT_EQ(state().camera.up, glm::dvec3(0, -1, 0)) << "the last key";
    }
    // 1.6 s of script at 60 frames a second, and as many as widgets need to answer at once.
    EXPECT_GE(frames[0], 96);
    EXPECT_LE(frames[0], 96 + 8 * 4);
    EXPECT_LT(frames[1], frames[0] / 2);
    EXPECT_LE(frames[2], 8 * 4);
}

TEST_F(ScriptDeskTest, APressTakesTheWindowBackAndLetsGoOfTheStroke) {
    ScriptDesk desk("", {800, 600}, 1.0);
    desk.play(parse_script(kStroke, "stroke.jsonl").value(), 1000.0);
    for (int i = 0; i < 60 && !state().drag; ++i)
        turn(desk);
    ASSERT_TRUE(state().drag) << "the script presses the button";
    turn(desk, {{.kind = Event::Kind::move, .at_px = {1.0, 1.0}}});
    EXPECT_TRUE(desk.is_playing()) << "a move of the mouse changes nothing";
    EXPECT_NE(state().pointer_px, glm::dvec2(1.0));
    turn(desk, {{.kind = Event::Kind::key, .down = true, .key = "b"}});
    EXPECT_FALSE(desk.is_playing());
    for (int i = 0; i < 4; ++i)
        turn(desk);
    EXPECT_FALSE(state().drag);
    EXPECT_EQ(state().tool, &kCutTool) << "the key only took the window back";
    EXPECT_NE(viewer().interface().message().find("the window is yours"), std::string::npos)
        << viewer().interface().message();
    turn(desk, {{.kind = Event::Kind::key, .down = true, .key = "b"}});
    EXPECT_EQ(state().tool, &kDrawTool);
}

TEST_F(ScriptDeskTest, TheWindowsCloseIsNotLost) {
    ScriptDesk desk("", {800, 600}, 1.0);
    desk.play(parse_script(kStroke, "stroke.jsonl").value(), 1.0);
    turn(desk);
    turn(desk, {{.kind = Event::Kind::close}});
    for (int i = 0; i < 3; ++i)
        turn(desk);
    EXPECT_TRUE(viewer().is_done());
}

TEST_F(ScriptDeskTest, APlaceThatIsNotShownEndsIt) {
    ScriptDesk desk("", {800, 600}, 1.0);
    desk.play(parse_script(R"({"palpate_view": 2, "size": [800, 600]}
{"frame": 1, "move": {"widget": "no/such", "share": [0.5, 0.5]}}
{"frame": 2, "button": "left", "down": true}
)",
                           "absent.jsonl")
                  .value(),
              1.0);
    for (int i = 0; i < 20; ++i)
        turn(desk);
    EXPECT_FALSE(desk.is_playing());
    EXPECT_NE(viewer().interface().message().find("no/such"), std::string::npos);
}

// By the buttons of the window: what is recorded does the same once more, and does not press stop.
TEST_F(ScriptDeskTest, ARecordingOfTheWindowDoesTheSame) {
    namespace fs = std::filesystem;
    const fs::path before = fs::current_path(),
                   folder = fs::path(::testing::TempDir()) / "palpate_recording";
    fs::remove_all(folder);
    fs::create_directories(folder);
    fs::current_path(folder);
    open("synthetic:phantom?size=24", {1280, 1000});
    ScriptDesk desk("", {1280, 1000}, 1.0);
    const auto press = [&](glm::dvec2 at) {
        turn(desk, {{.kind = Event::Kind::move, .at_px = at}});
        turn(desk, {{.kind = Event::Kind::button, .down = true}});
        turn(desk, {{.kind = Event::Kind::button, .down = false}});
        turn(desk);
        turn(desk);
    };
    const auto press_widget = [&](const std::string& id) {
        const auto& widgets = viewer().interface().widgets();
        ASSERT_TRUE(widgets.count(id)) << id;
        const Box box = widgets.at(id);
        press(glm::dvec2(box.low_px) + 0.5 * glm::dvec2(box.size_px));
    };
    const auto key_press = [&](const std::string& name) {
        turn(desk, {{.kind = Event::Kind::key, .down = true, .key = name}});
        turn(desk, {{.kind = Event::Kind::key, .key = name}});
    };
    press_widget("task/export");
    press_widget("section/session"); // unfolds it
    press_widget("session/record");
    EXPECT_EQ(state().scripts.recording, (folder / "session.jsonl").string());
    key_press("x");
    press(middle(Panel::axial) + glm::dvec2(0.0, 30.0));
    press_widget("session/stop");
    EXPECT_TRUE(state().scripts.recording.empty());
    const uint64_t expected = cut_hash();
    const Script recorded = load_script(folder / "session.jsonl").value();
    size_t presses = 0;
    for (const Script::Line& line : recorded.lines)
        presses += line.event.kind == Event::Kind::button && line.event.down;
    EXPECT_EQ(presses, 1u) << "the press on stop is not one of them";
    open("synthetic:phantom?size=24", {1280, 1000});
    ASSERT_NE(cut_hash(), expected);
    ASSERT_TRUE(replay(viewer(), recorded));
    EXPECT_EQ(cut_hash(), expected);
    fs::current_path(before);
    fs::remove_all(folder);
}

} // namespace
} // namespace palpate::view
