// The window of touch: what its widgets do, and where it lies.

#include <gtest/gtest.h>

#include "tests/view/hand_fixture.h"

namespace palpate::view {
namespace {

class TouchPanel : public HandTest {};

TEST_F(TouchPanel, WidgetsOfTheTouchWindowDoWhatTheySay) {
    open("synthetic:ball?size=24", {1280, 800}); // all are seen
    key("y");
    EXPECT_TRUE(state().touch_open);
    click_widget("touch/start");
    EXPECT_TRUE(touch().running());
    click_widget("touch/arm");
    EXPECT_TRUE(touch().armed());
    click_widget("touch/arm");
    EXPECT_FALSE(touch().armed());
    click_widget("touch/arrow");
    EXPECT_TRUE(state().stylus.arrow_shown);
    const double stiffness = viewer().work().session().parameters().stiffness_n_per_m;
    click_widget("touch/stiffness", 0.5);
    EXPECT_GT(viewer().work().session().parameters().stiffness_n_per_m, 2.0 * stiffness);
    click_widget("touch/friction", 0.5);
    EXPECT_GT(viewer().work().session().parameters().friction_static, 0.3); // as the dynamic one
    click_widget("touch/start");
    EXPECT_FALSE(touch().running());
}

// The tools stay as they are where there is room beside them, else all of them can be scrolled to.
TEST_F(TouchPanel, ThePanelOfTouchCoversNeitherToolsNorViews) {
    open("synthetic:ball?size=24", {1280, 800});
    const auto covers = [&](const Box& box) {
        const Box touch = places_of(state()).touch;
        const glm::ivec2 low = glm::max(box.low_px, touch.low_px),
                         high = glm::min(box.low_px + box.size_px, touch.low_px + touch.size_px);
        return low.x < high.x && low.y < high.y;
    };
    const auto expect_apart = [&] {
        const Places places = places_of(state());
        EXPECT_GT(places.touch.size_px.x, 0);
        EXPECT_FALSE(covers(places.tools));
        EXPECT_FALSE(covers(places.status));
        for (const Places::View& view : places.views)
            EXPECT_FALSE(covers(view.box));
        // The drawing begins there: the first of its widgets, and none of the tools'. Panels cut
        // off what does not fit.
        const auto corner = [&](const char* widget) {
            return Box{viewer().interface().widgets().at(widget).low_px, {1, 1}};
        };
        EXPECT_TRUE(covers(corner("touch/device")));
        EXPECT_FALSE(covers(corner("panel/width")));
    };
    const Box tools = places_of(state()).tools;
    const auto pixels_of_tools = [&](const Image& image) {
        std::vector<float> values;
        for (int y = tools.low_px.y; y < tools.low_px.y + tools.size_px.y; ++y)
            for (int x = tools.low_px.x; x < tools.low_px.x + tools.size_px.x; ++x)
                for (uint32_t c = 0; c < 3; ++c)
                    values.push_back(
                        image.at(static_cast<uint32_t>(x), static_cast<uint32_t>(y), c));
        return values;
    };
    frame({}); // a scroll bar comes a frame late
    const std::vector<float> before = pixels_of_tools(viewer().capture());
    key("y");
    frame({});
    EXPECT_EQ(places_of(state()).tools, tools);
    EXPECT_TRUE(pixels_of_tools(viewer().capture()) == before);
    expect_apart();
    show("appearance");
    click_widget("file/text");
    click_widget("file/text/2");
    frame({});
    show("window");
    expect_apart();
    frame({{.kind = Event::Kind::resize, .size_px = kSmallestWindow_px}});
    frame({});
    EXPECT_EQ(state().text_scale, 2.0);
    expect_apart();
}

// Asking the machine for its devices takes longer than a frame has: once a second is enough.
TEST_F(TouchPanel, TheListOfDevicesIsAskedForOnceASecond) {
    int asked = 0;
    HandOptions options;
    options.list = [&asked] {
        ++asked;
        return haptics::list_devices();
    };
    open("synthetic:ball?size=24", {800, 600}, options);
    key("y");
    frame({}, 1.0);
    EXPECT_EQ(asked, 0); // the list is closed
    click_widget("touch/device");
    const int at_first = asked;
    EXPECT_GE(at_first, 1);
    for (int i = 0; i < 300; ++i) // three seconds
        frame({}, 0.01);
    EXPECT_GE(asked - at_first, 2);
    EXPECT_LE(asked - at_first, 4);
}

} // namespace
} // namespace palpate::view
