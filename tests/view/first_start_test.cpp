// A window without a file, and the hints of a first start.

#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

class FirstStart : public ViewerTest {
 protected:
    bool has(const std::string& id) { return viewer().interface().widgets().count(id) > 0; }
    void open_welcome(std::vector<std::string> recent = {}) {
        set_options([recent](ViewerOptions& options) {
            options.asks_for_file = true;
            options.recent = [recent](const std::string&) { return recent; };
            options.small_picture = [](const std::string& path) -> Result<std::vector<std::byte>> {
                if (path == "/there/is/no picture.nii")
                    return fail("none");
                const auto value = static_cast<std::byte>(path.size());
                return std::vector<std::byte>(
                    size_t{4} * SeriesPreviews::kSide_px * SeriesPreviews::kSide_px, value);
            };
        });
        open("synthetic:phantom?size=24", {1280, 800});
        frame({}); // a dialog is placed by its size of the frame before
        frame({});
    }
    void open_with_hints(bool seen) {
        Settings settings;
        settings.hints_seen = seen;
        set_settings(settings);
        set_options([this](ViewerOptions& options) {
            options.hints = true;
            options.keep_settings = [this](const Settings& changed) { kept_ = changed; };
        });
        open("synthetic:phantom?size=24", {1280, 800});
        frame({});
        frame({});
    }
    Settings kept_;
};

TEST_F(FirstStart, AnExampleOpensByAClick) {
    open_welcome();
    for (const char* id :
         {"welcome/open", "welcome/example/0", "welcome/example/1", "welcome/example/2"})
        EXPECT_TRUE(has(id)) << id;
    EXPECT_FALSE(has("welcome/recent/0"));
    click(glm::dvec2(viewer().interface().widgets().at("welcome/example/2").low_px) + 20.0);
    frame({});
    EXPECT_EQ(viewer().work().title(), "synthetic:ball?size=96");
    EXPECT_FALSE(state().welcome_open);
}

TEST_F(FirstStart, FilesThatWereOpenedLastAreOffered) {
    open_welcome({"/a/scan.nii", "/there/is/no picture.nii", "3", "4", "5", "6", "7"});
    EXPECT_TRUE(has("welcome/recent/4"));
    EXPECT_FALSE(has("welcome/recent/5")) << "the chooser has all";
    // Each is apart from the others, and all lie in the window.
    std::vector<Box> boxes;
    for (const auto& [id, box] : viewer().interface().widgets())
        if (id.starts_with("welcome/"))
            boxes.push_back(box);
    ASSERT_EQ(boxes.size(), 1u + 5u + 3u);
    const Box window{{0, 0}, glm::ivec2(state().size_px)};
    for (size_t i = 0; i < boxes.size(); ++i) {
        EXPECT_TRUE(window.holds(glm::dvec2(boxes[i].low_px)));
        EXPECT_TRUE(window.holds(glm::dvec2(boxes[i].low_px + boxes[i].size_px - 1)));
        for (size_t j = 0; j < i; ++j) {
            const glm::ivec2 low = glm::max(boxes[i].low_px, boxes[j].low_px),
                             high = glm::min(boxes[i].low_px + boxes[i].size_px,
                                             boxes[j].low_px + boxes[j].size_px);
            EXPECT_FALSE(low.x < high.x && low.y < high.y) << i << " " << j;
        }
    }
    EXPECT_TRUE(viewer().shot()); // with pictures, and without one
}

TEST_F(FirstStart, EscapeLeavesThePhantom) {
    open_welcome();
    key("escape");
    EXPECT_FALSE(has("welcome/open"));
    EXPECT_FALSE(state().welcome_open);
    open_welcome();
    click_widget("welcome/open");
    EXPECT_TRUE(state().browser_open);
}

TEST_F(FirstStart, HintsGoAsTheyAreFollowedAndNeverComeAgain) {
    open_with_hints(false);
    ASSERT_TRUE(has("hints/close"));
    EXPECT_FALSE(kept_.hints_seen);
    move(middle(Panel::axial));
    frame({{.kind = Event::Kind::wheel, .wheel = {0.0, 1.0}}});
    EXPECT_TRUE(state().hints.followed[0]);
    click_widget("tool/draw");
    EXPECT_TRUE(state().hints.followed[1]);
    key("k", {.ctrl = true});
    frame({});
    key("escape");
    EXPECT_TRUE(state().hints.followed[2]);
    EXPECT_TRUE(has("hints/close"));
    take_task(WindowTask::measure);
    frame({});
    EXPECT_FALSE(has("hints/close"));
    EXPECT_TRUE(kept_.hints_seen);
    open_with_hints(true);
    EXPECT_FALSE(has("hints/close"));
}

TEST_F(FirstStart, HintsAreClosedByAPerson) {
    open_with_hints(false);
    const Box close = viewer().interface().widgets().at("hints/close");
    click(glm::dvec2(close.low_px + close.size_px / 2));
    frame({});
    EXPECT_FALSE(has("hints/close"));
    EXPECT_TRUE(kept_.hints_seen);
}

} // namespace
} // namespace palpate::view
