// The live-wire tool: contours along edges that become labels.

#include "apps/view/tools/wire_tool.h"

#include <algorithm>
#include <set>

#include "engine/volume/extent.h"
#include "tests/view/recorded_session.h"
#include "tests/view/subjects.h"

namespace palpate::view {
namespace {

// The inside of a closed contour along an axis is what a flood from outside does not reach.
TEST(WireFill, IsWhatAFloodFromOutsideDoesNotReach) {
    std::mt19937 random(3);
    constexpr int kSide = 24;
    for (int round = 0; round < 60; ++round) {
        const int axis = round % 3, across = axis == 0 ? 1 : 0, down = axis == 2 ? 1 : 2;
        // A star about the middle: its corners joined by steps to neighbours, so that it is closed.
        std::vector<glm::ivec2> corners;
        for (int i = 0; i < 12; ++i) {
            const double angle = 2.0 * 3.14159265358979 * i / 12, far = 3.0 + random() % 8;
            corners.push_back(
                glm::ivec2(12.0 + far * std::cos(angle), 12.0 + far * std::sin(angle)));
        }
        std::vector<glm::uvec3> contour;
        std::vector<bool> wall(kSide * kSide);
        for (size_t i = 0; i < corners.size(); ++i) {
            const glm::ivec2 to = corners[(i + 1) % corners.size()];
            for (glm::ivec2 at = corners[i]; at != to; at += glm::sign(to - at)) {
                glm::uvec3 sample(7);
                sample[across] = static_cast<uint32_t>(at.x);
                sample[down] = static_cast<uint32_t>(at.y);
                contour.push_back(sample);
                wall[static_cast<size_t>(at.x + kSide * at.y)] = true;
            }
        }
        // Across faces: a contour of neighbours over corners keeps it out.
        std::vector<bool> outside(kSide * kSide);
        std::vector<glm::ivec2> front{{0, 0}};
        outside[0] = true;
        while (!front.empty()) {
            const glm::ivec2 at = front.back();
            front.pop_back();
            for (const glm::ivec2 by : {glm::ivec2(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
                const glm::ivec2 p = at + by;
                const auto n = static_cast<size_t>(p.x + kSide * p.y);
                if (p.x < 0 || p.y < 0 || p.x >= kSide || p.y >= kSide || outside[n] || wall[n])
                    continue;
                outside[n] = true;
                front.push_back(p);
            }
        }
        std::vector<bool> got(kSide * kSide);
        for (const glm::uvec3 p : filled(contour, axis)) {
            EXPECT_EQ(p[axis], 7u);
            got[p[across] + kSide * p[down]] = true;
        }
        for (size_t i = 0; i < got.size(); ++i)
            ASSERT_EQ(got[i], !outside[i]) << "round " << round << " sample " << i;
    }
}

TEST(WireTool, NeedsASliceAlongTheSamples) {
    std::mt19937 random(1);
    for (int round = 0; round < 10; ++round) {
        const Grid grid = random_grid(random);
        const auto slices = slice_views(grid);
        std::set<int> axes;
        for (const SliceView& slice : slices) {
            const auto axis = axis_across(grid, slice);
            ASSERT_TRUE(axis);
            axes.insert(*axis);
            SliceView turned = slice;
            turned.towards = glm::normalize(slice.towards + 0.01 * slice.right);
            EXPECT_FALSE(axis_across(grid, turned));
        }
        EXPECT_EQ(axes.size(), 3u);
    }
}

TEST(WireTool, ClicksFreezeAndEscapeDrops) {
    std::mt19937 random(2);
    const Subject subject = subject_of(random_grid(random));
    TestHand hand{subject};
    hand.take({.kind = Event::Kind::key, .down = true, .key = "u"});
    const Box box = box_of(hand.state, Panel::axial).value();
    const glm::dvec2 middle = glm::dvec2(box.low_px) + 0.5 * glm::dvec2(box.size_px);
    const auto click = [&](glm::dvec2 by) {
        hand.time_s += 1.0;
        hand.move(middle + by);
        hand.press(Button::left);
        hand.release(Button::left);
    };
    click({-30, -30});
    EXPECT_EQ(hand.state.own.of<Wiring>().frozen.size(), 1u);
    hand.move(middle);
    EXPECT_EQ(hand.state.own.of<Wiring>().live.size(), 2u) << "follows the pointer";
    click({40, -30});
    EXPECT_EQ(hand.state.own.of<Wiring>().frozen.size(), 2u);
    hand.take({.kind = Event::Kind::key, .down = true, .key = "enter"});
    EXPECT_EQ(std::ranges::count(hand.orders, Order(order::FillWire{})), 0)
        << "two samples have no inside";
    hand.orders.clear();
    click({40, 30});
    hand.take({.kind = Event::Kind::key, .down = true, .key = "escape"});
    EXPECT_TRUE(hand.state.own.of<Wiring>().frozen.empty());
    for (const glm::dvec2 by : {glm::dvec2(-30, -30), {40, -30}, {40, 30}})
        click(by);
    click({-29, -29}); // on the first
    EXPECT_EQ(hand.orders, std::vector<Order>{order::FillWire{}});
    EXPECT_EQ(hand.state.own.of<Wiring>().closed.size(), 3u);
    EXPECT_TRUE(hand.state.own.of<Wiring>().frozen.empty());
}

class Wire : public ViewerTest {
 protected:
    // A ball of 35 mm in 48 samples: six clicks a little off its edge, and Enter.
    void draw_round_the_ball(const char* end = "enter") {
        open("synthetic:ball?size=48");
        key("u");
        const double sample_mm = smallest_spacing_mm(grid());
        for (int i = 0; i < 6; ++i) {
            const double angle = 2.0 * 3.14159265358979 * i / 6,
                         far = 35.0 + (i % 2 ? 0.4 : -0.4) * sample_mm;
            const SliceView& slice = state().slices[0];
            const glm::dvec3 at = state().crosshair_mm + far * std::cos(angle) * slice.right +
                                  far * std::sin(angle) * slice.up;
            click(glm::round(pixel_of(state(), grid(), Panel::axial, at).value()));
        }
        key(end);
        frame({});
    }
    float highest_label() { return volume(Work::kLabels)->range().max; }
};

// The contour is of samples on the edge: what is filled is the disc, to one and a half samples
// (half a sample of rounding, and one of the edge, which lies between samples of equal gradient).
TEST_F(Wire, FillsTheDiscThatItsClicksAreOnAsOneStep) {
    draw_round_the_ball();
    const Volume labels = *volume(Work::kLabels);
    const double sample_mm = smallest_spacing_mm(grid());
    const glm::dvec3 middle = state().crosshair_mm;
    const int axis = axis_across(grid(), state().slices[0]).value();
    const uint32_t layer = sample_at(grid(), middle).value()[axis];
    size_t in_slice = 0, missed = 0, beyond = 0;
    for (uint32_t z = 0; z < 48; ++z)
        for (uint32_t y = 0; y < 48; ++y)
            for (uint32_t x = 0; x < 48; ++x) {
                const glm::uvec3 at(x, y, z);
                const bool is_in = labels.value(at) == 1.0f;
                const double far_mm = glm::distance(world_point(grid(), glm::dvec3(at)), middle);
                in_slice += is_in && at[axis] == layer;
                missed += !is_in && at[axis] == layer && far_mm < 35.0 - 1.5 * sample_mm;
                beyond += is_in && (at[axis] != layer || far_mm > 35.0 + 1.5 * sample_mm);
            }
    EXPECT_GT(in_slice, 100u);
    EXPECT_EQ(missed, 0u);
    EXPECT_EQ(beyond, 0u);
    EXPECT_EQ(viewer().work().edited().undo_steps, 1u);
    key("z", {.ctrl = true});
    frame({});
    EXPECT_EQ(highest_label(), 0.0f);
}

TEST_F(Wire, EscapeDropsIt) {
    draw_round_the_ball("escape");
    EXPECT_EQ(highest_label(), 0.0f);
    EXPECT_EQ(viewer().work().edited().undo_steps, 0u);
    EXPECT_TRUE(state().own.of<Wiring>().frozen.empty());
}

const RecordedSteps kWireSessions[] = {
    {"wire_key", "key u", R"({"tool": {"hand": "wire"}, "segment": {"wire_samples": 0}})"},
    {"wire_in_the_panel", "section wire; widget segment/wire 0.05",
     R"({"tool": {"hand": "wire"}})"},
    {"wire_is_begun", "key u; at axial -40 0; click left",
     R"({"segment": {"wire_samples": 1}, "undo_steps": 0})"},
    {"wire_by_a_double_click",
     "key u; at axial -40 0; click left; at axial 0 -40; click left; at axial 40 0; click left; "
     "at axial 0 40; double left",
     R"({"segment": {"wire_samples": 0}, "undo_steps": 1})"},
    {"wire_on_an_oblique_slice",
     "at axial 107 5; drag left 0 40; key u; at coronal 20 20; click left",
     R"({"segment": {"wire_samples": 0}, "undo_steps": 0})"},
};

class WireSessions : public RecordedSession {};
TEST_P(WireSessions, End) {
    expect_end();
}
INSTANTIATE_TEST_SUITE_P(View, WireSessions, ::testing::ValuesIn(kWireSessions),
                         [](const auto& test) { return std::string(test.param.name); });

} // namespace
} // namespace palpate::view
