// Tools whose clicks take regions: local threshold and level tracing.

#include "apps/view/tools/click_tools.h"

#include <algorithm>

#include "apps/view/tools/region_preview.h"
#include "engine/program/surface_labels.h"
#include "engine/volume/builder.h"
#include "engine/volume/extent.h"
#include "tests/view/recorded_session.h"
#include "tests/view/subjects.h"

namespace palpate::view {
namespace {

TEST(ClickTools, AskForTheSampleUnderThePointer) {
    std::mt19937 random(3);
    for (int round = 0; round < 5; ++round) {
        const Subject subject = subject_of(random_grid(random));
        TestHand hand{subject};
        for (const char* key : {".", "0"})
            for (const Panel panel : {Panel::axial, Panel::coronal, Panel::sagittal}) {
                hand.key(key);
                hand.orders.clear();
                hand.move(hand.middle(panel) + glm::dvec2(7.0, -3.0));
                const auto under = hand.state.own.of<Clicking>().under;
                const glm::dvec3 point =
                    point_under(hand.state, subject.grid, panel, hand.state.pointer_px);
                ASSERT_TRUE(under);
                if (const auto* local = std::get_if<LocalThreshold>(&*under))
                    EXPECT_EQ(local->at, sample_at(subject.grid, point));
                else
                    EXPECT_NEAR(
                        glm::distance(world_point(subject.grid, std::get<LevelTrace>(*under).at),
                                      point),
                        0.0, 1e-9);
                EXPECT_EQ(std::holds_alternative<LocalThreshold>(*under), key[0] == '.');
                hand.time_s += 1.0;
                hand.press(Button::left);
                hand.release(Button::left);
                EXPECT_EQ(hand.given<order::ChangeLabel>(0).change,
                          key[0] == '.' ? &kLocalChange : &kTraceChange);
                EXPECT_EQ(hand.state.own.of<Clicking>().clicked, *under);
            }
        hand.move(hand.middle(Panel::volume));
        EXPECT_FALSE(hand.state.own.of<Clicking>().under) << "in 3D nothing is asked for";
    }
}

TEST(ClickTools, KeysWidenAndNarrowTheRange) {
    std::mt19937 random(4);
    const Subject subject = subject_of(random_grid(random));
    TestHand hand{subject};
    hand.key(".");
    hand.move(hand.middle(Panel::axial));
    const auto times = [&] {
        return std::get<LocalThreshold>(*hand.state.own.of<Clicking>().under).times;
    };
    const double before = times(), radius_mm = hand.state.radius_mm;
    hand.key("=");
    EXPECT_GT(times(), 1.1 * before);
    hand.key("-");
    hand.key("-");
    EXPECT_LT(times(), 0.9 * before);
    EXPECT_EQ(hand.state.radius_mm, radius_mm) << "the keys are this tool's";
    hand.key("b");
    hand.key("=");
    EXPECT_GT(hand.state.radius_mm, radius_mm);
}

// A box of 200 x 200 x 100 samples is 4 million: one more layer is too many at each move.
TEST(ClickTools, NothingIsOutlinedOverFourMillionSamples) {
    for (const uint32_t layers : {100u, 101u}) {
        const Subject subject = subject_of(make_grid({200, 200, layers}, glm::dvec3(0.5)));
        TestHand hand{subject};
        hand.key(".");
        hand.state.own.of<Clicking>().reach_mm = 500.0;
        hand.move(hand.middle(Panel::axial));
        ASSERT_TRUE(hand.state.own.of<Clicking>().under);
        EXPECT_EQ(hand.state.own.of<Clicking>().is_outlined, layers == 100);
        hand.time_s += 1.0;
        hand.press(Button::left);
        hand.release(Button::left);
        EXPECT_EQ(hand.given<order::ChangeLabel>(0).change, &kLocalChange);
    }
}

// The lines about a region lie where a sample that is taken is beside one that
// is not, and nowhere else; each such side once.
TEST(RegionPreview, OutlinesTheRegion) {
    std::mt19937 random(5);
    const Grid grid = make_grid({12, 9, 7}, glm::dvec3(1.0));
    const Volume volume =
        make_volume(grid, ScalarType::u8, [&](glm::uvec3) { return double(random() % 3 > 0); });
    RegionPreview preview;
    size_t sides = 0;
    for (uint32_t x = 0; x < 12; ++x) {
        const LocalThreshold click{.at = {x, 4, 3}, .near_mm = 0.0, .times = 0.2};
        preview.want(volume, click, false);
        const ClickRegion region = local_region(volume, click, {}).value();
        ASSERT_TRUE(preview.region());
        EXPECT_EQ(*preview.region(), region);
        for (int axis = 0; axis < 3; ++axis)
            for (uint32_t layer = 0; layer < grid.size[axis]; ++layer) {
                double length = 0.0, expected = 0.0;
                for (const auto& [from, to] : *preview.sides(axis, layer)) {
                    length += glm::distance(from, to);
                    EXPECT_EQ(from[axis], layer);
                }
                for (int along = 0; along < 3; ++along) {
                    if (along == axis)
                        continue;
                    for (uint32_t z = 0; z < grid.size.z; ++z)
                        for (uint32_t y = 0; y < grid.size.y; ++y)
                            for (uint32_t i = 0; i < grid.size.x; ++i) {
                                const glm::uvec3 at(i, y, z);
                                if (at[axis] != layer || !region.has(at))
                                    continue;
                                for (const int by : {-1, 1}) {
                                    glm::ivec3 next(at);
                                    next[along] += by;
                                    const bool beyond =
                                        next[along] < 0 || next[along] >= int(grid.size[along]);
                                    expected += beyond || !region.has(glm::uvec3(next));
                                }
                            }
                }
                EXPECT_NEAR(length, expected, 1e-9);
                sides += expected > 0.0;
            }
    }
    EXPECT_GT(sides, 50u);
}

// On a thread the newest place is the one that is shown in the end.
TEST(RegionPreview, EndsWithTheNewestPlace) {
    const Grid grid = make_grid({40, 40, 40}, glm::dvec3(1.0));
    const Volume volume =
        make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) { return double(i.x / 10); });
    RegionPreview preview;
    for (uint32_t x = 0; x < 40; ++x)
        preview.want(volume, LocalThreshold{.at = {x, 20, 20}}, true);
    preview.wait();
    ASSERT_TRUE(preview.region());
    EXPECT_EQ(*preview.region(), local_region(volume, {.at = {39, 20, 20}}, {}).value());
}

class ClickWindow : public ViewerTest {
 protected:
    uint64_t count() { return count_labels(*volume(Work::kLabels))[1]; }
    glm::dvec2 middle() {
        const Box box = box_of(state(), Panel::axial).value();
        return glm::floor(glm::dvec2(box.low_px) + 0.5 * glm::dvec2(box.size_px));
    }
};

// A click takes what was outlined before it, as one step.
TEST_F(ClickWindow, TakesWhatIsOutlined) {
    for (const char* tool : {".", "0"}) {
        open("synthetic:ball?size=40");
        key(tool);
        glm::dvec2 at = middle();
        if (tool[0] == '0') // on the edge of the ball
            at = glm::round(pixel_of(state(), grid(), Panel::axial,
                                     state().crosshair_mm + 35.0 * state().slices[0].right)
                                .value());
        move(at);
        frame({});
        const auto region = state().own.of<Previewing>().preview->region();
        ASSERT_TRUE(region);
        EXPECT_GT(region->count, 200u);
        click(at);
        EXPECT_EQ(count(), region->count);
        EXPECT_EQ(viewer().work().edited().undo_steps, 1u);
        key("z", {.ctrl = true});
        frame({});
        EXPECT_EQ(count(), 0u);
    }
}

const RecordedSteps kClickSessions[] = {
    {"local_key", "key .", R"({"tool": {"hand": "local"}})"},
    {"trace_key", "key 0", R"({"tool": {"hand": "trace"}})"},
    {"local_in_the_panel",
     "section wire; widget segment/local 0.05; widget click/times 0.5; widget "
     "click/reach 0.5; at "
     "axial 0 0; click left",
     R"({"tool": {"hand": "local"}, "undo_steps": 1})"},
    {"trace_on_an_oblique_slice",
     "at axial 107 5; drag left 0 40; key 0; at coronal 20 20; click left",
     R"({"undo_steps": 0, "message": "level tracing needs a slice along the samples: R turns planes back"})"},
    {"local_on_an_oblique_slice",
     "at axial 107 5; drag left 0 40; key .; at coronal 20 20; click left",
     R"({"undo_steps": 0, "message": "local threshold needs a slice along the samples: R turns planes back"})"},
};

class ClickSessions : public RecordedSession {};
TEST_P(ClickSessions, End) {
    expect_end();
}
INSTANTIATE_TEST_SUITE_P(View, ClickSessions, ::testing::ValuesIn(kClickSessions),
                         [](const auto& test) { return std::string(test.param.name); });

} // namespace
} // namespace palpate::view
