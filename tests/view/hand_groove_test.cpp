// A drag of the mouse as the hand, while it cuts.

#include "apps/view/tools/hand_pointer.h"
#include "apps/view/window/interaction.h"
#include "engine/volume/builder.h"
#include "engine/volume/content_hash.h"
#include "tests/view/hand_fixture.h"

namespace palpate::view {
namespace {

// The tool goes along what was seen before the press, and not in the plane where that began: over a
// ball the groove is as deep everywhere.
TEST_F(HandTest, ADragCutsAGrooveAlongWhatWasSeen) {
    open("synthetic:ball?size=64", {1000, 800});
    key("x");
    start_mouse();
    const Volume before = *volume(Work::kGrey);
    const auto seen = [&](double across_px) {
        return viewer().work().subject().pick(
            ray_under(state(), middle(Panel::volume) + glm::dvec2(across_px, 10.0)));
    };
    constexpr int kReach_px = 120;
    std::vector<glm::dvec3> path;
    for (int x = -kReach_px; x <= kReach_px; x += 4)
        path.push_back(seen(x).value());
    // It is no plane across the view.
    EXPECT_GT(glm::dot(path[path.size() / 2] - path[0], towards_eye()), 2.0 * state().radius_mm);
    const auto go = [&](int x) {
        frame({{.kind = Event::Kind::move, .at_px = middle(Panel::volume) + glm::dvec2(x, 10.0)}},
              0.05);
    };
    go(-kReach_px);
    wait(2.0);
    button(true);
    wait(0.5);
    for (int x = -kReach_px; x <= kReach_px; x += 2)
        go(x);
    wait(0.5);
    button(false);
    wait(0.5);
    const Volume after = *volume(Work::kGrey);
    const double spacing = spacing_mm(grid()).x;
    double deepest = 0.0;
    for (uint32_t z = 0; z < 64; ++z)
        for (uint32_t y = 0; y < 64; ++y)
            for (uint32_t x = 0; x < 64; ++x)
                if (after.value({x, y, z}) < before.value({x, y, z}))
                    deepest = std::max(deepest, kRadius_mm - glm::length(world_point(
                                                                 grid(), glm::dvec3(x, y, z))));
    // The tool, the sample that its wall is wide, and how far the hand is off the surface that is
    // seen from 500 on: by the edge of the ball, 1.5 mm wide, and by the felt radius.
    EXPECT_GT(deepest, 0.5 * state().radius_mm);
    EXPECT_LT(deepest, state().radius_mm + 2.0 * spacing);
    for (const glm::dvec3 at : path) // half a radius below the surface it is open
        EXPECT_LT(
            after.value(*sample_at(grid(), at - 0.5 * state().radius_mm * glm::normalize(at))),
            500.0f)
            << at.x << " " << at.y << " " << at.z;
}

// Off the edge of what is seen the depth stays: a tool that is pressed does not jump to what lies
// far behind.
TEST_F(HandTest, APressedToolDoesNotJumpToWhatLiesFarBehind) {
    open("synthetic:ball?size=64", {1000, 800});
    start_mouse();
    Subject subject = viewer().work().subject();
    double far_mm = 0.0;
    const Ray middle_ray = ray_under(state(), middle(Panel::volume));
    const glm::dvec3 near = subject.pick(middle_ray).value();
    subject.pick = [&](const Ray& ray) {
        return std::optional(near + ray.origin_mm - middle_ray.origin_mm + far_mm * ray.direction);
    };
    ViewState now = state();
    const auto depth_after = [&](glm::dvec2 by_px) {
        Event event{.kind = Event::Kind::move, .at_px = middle(Panel::volume) + by_px};
        now = after(now, event, subject).state;
        return now.stylus.depth_mm;
    };
    const double depth = depth_after({0, 0});
    now.stylus.buttons = 1;
    far_mm = 60.0;
    EXPECT_EQ(depth_after({2, 0}), depth);
    far_mm = 0.5 * now.radius_mm;
    EXPECT_NEAR(depth_after({4, 0}), depth + far_mm, 0.5);
    const double before = now.stylus.depth_mm;
    far_mm = 60.0;
    EXPECT_EQ(depth_after({90, 0}), before); // one long move, too
    now.stylus.buttons = 0;
    EXPECT_GT(depth_after({2, 0}), depth + 50.0);
}

// Beside the hand, as one sees it, a tool is held by what lies between; in depth it may be away.
TEST(ToolWithHand, IsWhereOneSeesTheHand) {
    Stylus stylus{.by_pointer = true, .push_mm = 2.0};
    stylus.meant.position_mm = {10, 0, 0};
    stylus.eye_mm = {10, 0, 500};
    stylus.clear_mm = 8.0;
    const glm::dvec3 hand(12, 1, 3);
    const auto is_there = [&](glm::dvec3 off) {
        return is_tool_with_hand(stylus, 4.0, hand, hand + off);
    };
    EXPECT_TRUE(is_there({0, 0, 40}));
    EXPECT_TRUE(is_there({0, 0, -40}));
    EXPECT_TRUE(is_there({0, 7.9, 0}));
    EXPECT_TRUE(is_there({-5.5, 5.5, 30}));
    EXPECT_FALSE(is_there({0, 8.1, 0}));
    EXPECT_FALSE(is_there({6, 6, -20}));
    stylus.push_mm = 5.0; // deeper, and so farther off a steep surface
    EXPECT_TRUE(is_there({0, 8.1, 0}));
    stylus.clear_mm = 0.0; // in a slice
    EXPECT_TRUE(is_there({90, 0, 0}));
}

// Seen from above, a block with a pit stands on a floor. A tool in the pit is held there when the
// pointer goes to the floor: a press does not bore through the block, and is told.
TEST_F(HandTest, AToolThatIsHeldElsewhereIsNotPressed) {
    Source source{open_synthetic("synthetic:ball?size=64")};
    Volume& volume = source.scene.loaded.data.volume;
    const Grid grid = volume.grid();
    volume = make_volume(grid, volume.type(), [&](glm::uvec3 i) {
        const glm::dvec3 p = world_point(grid, glm::dvec3(i));
        const bool is_pit = glm::length(glm::dvec2(p)) < 8.0 && p.z > 10.0;
        const bool is_block = std::abs(p.x) <= 20.0 && p.z <= 20.0 && !is_pit;
        return is_block || p.z <= -20.0 ? 1000.0 : 0.0;
    });
    open_scene(std::move(source), {1000, 800});
    key("home"); // from above
    key("x");
    start_mouse();
    const auto point_at = [&](glm::dvec3 at_mm) {
        move(pixel_of(state(), viewer().work().subject().grid, Panel::volume, at_mm).value());
        wait(2.0);
    };
    const auto cut = [&] {
        const uint64_t before = content_hash(*this->volume(Work::kGrey));
        button(true);
        wait(1.5);
        const std::string told = viewer().interface().message();
        button(false);
        wait(0.5);
        return std::pair(content_hash(*this->volume(Work::kGrey)) != before, told);
    };
    point_at({0, 0, 10});
    const double radius_mm = state().radius_mm;
    EXPECT_LT(std::abs(now().proxy.position_mm.z - 10.0), 2.0 * radius_mm); // in the pit
    point_at({35, 0, -20});
    EXPECT_GT(now().probe.position_mm.x, 30.0);
    ASSERT_LT(now().proxy.position_mm.x, 20.0);
    const auto [has_cut, told] = cut();
    EXPECT_FALSE(has_cut);
    EXPECT_TRUE(told.starts_with("the tool is held by what lies between")) << told;
    point_at({35, 0, -20}); // fetched: over the block, and into the pit
    point_at({10, 15, 20});
    point_at({0, 0, 10});
    EXPECT_TRUE(cut().first);
}

} // namespace
} // namespace palpate::view
