// Texts over the views of windows that have little room for them.

#include <gtest/gtest.h>

#include <algorithm>

#include "engine/volume/builder.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

class SmallWindow : public ViewerTest {
 protected:
    // A volume whose places have many digits: "S 537.8 mm, 57 of 112".
    void open_far_away(glm::uvec2 size_px) {
        Source source{open_synthetic("synthetic:ball?size=24")};
        source.scene.loaded.data.volume =
            make_volume(make_grid({122, 101, 112}, {3, 3, 3}, {-471.3, 271.3, 371.3}),
                        ScalarType::i16, [](glm::uvec3 i) { return 20.0 * i.x - 1000.0; });
        open_window(std::move(source), size_px);
    }
    size_t count(Panel panel, const char* begin) {
        const auto& texts = viewer().interface().texts();
        return static_cast<size_t>(
            std::count_if(texts.begin(), texts.end(), [&](const ViewText& one) {
                return one.panel == panel && one.text.starts_with(begin);
            }));
    }
    void expect_apart() {
        const auto& texts = viewer().interface().texts();
        for (size_t i = 0; i < texts.size(); ++i) {
            const Box view = box_of(state(), texts[i].panel).value(), box = texts[i].box;
            const glm::ivec2 high = box.low_px + box.size_px;
            EXPECT_TRUE(glm::all(glm::greaterThanEqual(box.low_px, view.low_px)) &&
                        glm::all(glm::lessThanEqual(high, view.low_px + view.size_px)))
                << texts[i].text;
            for (size_t j = 0; j < i; ++j) {
                const Box other = texts[j].box;
                EXPECT_FALSE(glm::all(glm::lessThan(box.low_px, other.low_px + other.size_px)) &&
                             glm::all(glm::lessThan(other.low_px, high)))
                    << texts[i].text << " covers " << texts[j].text;
            }
        }
    }
    // Expected in every size: which view it is, where its slice lies, and the sides of the patient.
    void expect_what_matters() {
        for (const auto& [panel, place, sides] :
             {std::tuple(Panel::axial, "S ", "RLAP"), std::tuple(Panel::coronal, "P ", "RLSI"),
              std::tuple(Panel::sagittal, "R ", "APSI")}) {
            EXPECT_EQ(count(panel, title_of(panel)), 1u);
            EXPECT_EQ(count(panel, place), 1u) << name_of(panel);
            for (const char* side = sides; *side; ++side)
                EXPECT_GE(count(panel, std::string(1, *side).c_str()), 1u) << *side;
        }
        EXPECT_EQ(count(Panel::volume, "3D"), 1u);
    }
};

TEST_F(SmallWindow, NoTextOfAViewCoversAnother) {
    for (const glm::uvec2 size :
         {kSmallestWindow_px, glm::uvec2(640, 480), glm::uvec2(800, 600), glm::uvec2(1280, 800)}) {
        SCOPED_TRACE(size.x);
        open_far_away(size);
        expect_apart();
        expect_what_matters();
    }
    for (const Panel panel : {Panel::axial, Panel::coronal, Panel::sagittal})
        EXPECT_EQ(count(panel, "W "), 1u); // where there is room
}

// All buttons of the tool bar can be pressed, in every window and with all letters.
TEST_F(SmallWindow, ToolsLieWithinTheirBarAndApart) {
    for (const glm::uvec2 size :
         {kSmallestWindow_px, glm::uvec2(1280, 720), glm::uvec2(3840, 2160)})
        for (const double text_scale : {1.0, 1.5, 2.0}) {
            SCOPED_TRACE(fmt::format("{} x {} at {}", size.x, size.y, text_scale));
            open_window(Source{open_synthetic("synthetic:ball?size=8")}, size, {}, {}, text_scale);
            const Box bar = places_of(state()).bar;
            std::vector<Box> buttons;
            for (const Tool* tool : tools())
                if (tool->title)
                    buttons.push_back(
                        viewer().interface().widgets().at(fmt::format("tool/{}", tool->name)));
            buttons.push_back(viewer().interface().widgets().at("bar/picture"));
            for (size_t i = 0; i < buttons.size(); ++i) {
                const glm::ivec2 low = buttons[i].low_px, high = low + buttons[i].size_px;
                EXPECT_TRUE(bar.holds(glm::dvec2(low)) && bar.holds(glm::dvec2(high - 1)));
                EXPECT_GE(buttons[i].size_px.x, 18); // large enough to be met by a mouse
                EXPECT_EQ(buttons[i].size_px.x, buttons[i].size_px.y);
                const int above = i > 0 ? buttons[i - 1].low_px.y + buttons[i - 1].size_px.y : 0;
                EXPECT_GE(low.y, above);
            }
        }
}

TEST_F(SmallWindow, NorDoLargeLetters) {
    open_far_away({1280, 800});
    click_widget("tab/file");
    click_widget("file/text");
    click_widget("file/text/2");
    frame({});
    frame({});
    ASSERT_EQ(state().text_scale, 2.0);
    expect_apart();
    expect_what_matters();
}

} // namespace
} // namespace palpate::view
