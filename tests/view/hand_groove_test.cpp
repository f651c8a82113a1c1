// A drag of the mouse as the hand, while it cuts.

#include "apps/palpate/view/interaction.h"
#include "engine/volume/builder.h"
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

} // namespace
} // namespace palpate::view
