#include <fmt/format.h>
#include <gtest/gtest.h>

#include "haptics/proxy/tool_contacts.h"
#include "tests/unit/haptics_proxy/yield_grid.h"

namespace palpate::haptics {
namespace {

void expect_held_at_t0(const PressCase& c, PressScenes& scenes, double& most_share) {
    SCOPED_TRACE(name_of(c));
    const Pressed pressed = press(c, scenes);
    EXPECT_TRUE(pressed.is_finite);
    EXPECT_LE(pressed.most_n, 1.03 * pressed.t0_n);
    // A small ball slips aside, and so does what stands on edge.
    const bool is_firm = c.body == 0 || c.body == 1 || c.body == 5;
    if (is_firm && pressed.asked_n > 1.5 * pressed.t0_n) {
        EXPECT_GE(pressed.most_n, 0.97 * pressed.t0_n);
    }
    most_share = std::max(most_share, pressed.most_n / pressed.t0_n);
}

// Every source of T0 meets every body, radius and rate in some case.
TEST(YieldSource, NoForceIsLargerThanT0WhereverItIsStated) {
    constexpr double kRadii[] = {0.4, 1.5, 3.0, 6.0}, kRates[] = {100.0, 1000.0, 4000.0};
    PressScenes scenes;
    double most = 0.0;
    uint32_t turn = 0;
    for (const T0From from : kAllT0)
        for (uint32_t body = 0; body < kPressBodies; ++body, ++turn) {
            PressCase c{.from = from,
                        .body = body,
                        .radius_mm = kRadii[turn % 4],
                        .hertz = kRates[(turn + body) % 3]};
            expect_held_at_t0(c, scenes, most);
            c.radius_mm = 0.0;
            c.algorithm = turn % 2 ? "swept-point" : "swept-local";
            expect_held_at_t0(c, scenes, most);
            if (from != T0From::parameters_grey) {
                c.algorithm = "swept-mesh";
                expect_held_at_t0(c, scenes, most);
            }
        }
    for (const char* algorithm : {"swept-tool", "swept-point", "swept-local", "swept-mesh"})
        expect_held_at_t0({.algorithm = algorithm,
                           .body = 1,
                           .radius_mm = std::string_view(algorithm) == "swept-tool" ? 1.0 : 0.0,
                           .hertz = 10000.0},
                          scenes, most);
    fmt::print("largest force: {:.4f} T0\n", most);
}

// A ball of 40 samples is wider than the table of blocks, and a groove holds it at two ends. Its
// looks must not make each other's blocks anew for ever, at no force.
TEST(YieldSource, ABallWiderThanTheTableOfBlocksIsHeldInAGroove) {
    PressScenes scenes;
    double most = 0.0;
    expect_held_at_t0(
        {.from = T0From::label_harder, .body = 5, .radius_mm = 10.0, .hertz = 1000.0, .seed = 100},
        scenes, most);
}

// A ball that yields is asked in each tick whether it is out of the material. Deep in a label its
// points lie in more blocks of 4x4x4 cells than the field keeps, each made of 13^3 samples.
TEST(YieldSource, AWideBallInALabelIsKnownToBeInItByAFewOfItsPoints) {
    const Grid grid = make_grid(glm::uvec3(64), glm::dvec3(0.5), glm::dvec3(-15.75));
    const Volume volume = make_volume(
        grid, ScalarType::u8, [](glm::uvec3 i) { return i.z < 20 || i.z >= 62 ? 0.0 : 3.0; });
    const TouchParameters q{.tool_radius_mm = 10.0, .source = TouchSource::labels};
    TouchScene scene{.version = 1};
    scene.labels = volume;
    const TickInput input{.scene = &scene, .parameters = &q};
    const auto contacts = std::make_unique<ToolContacts>();
    contacts->follow(input, volume);
    EXPECT_FALSE(contacts->is_free({0.0, 0.0, 4.5}));
    EXPECT_LE(contacts->field().filtered_samples(), 16u * 13u * 13u * 13u);
    EXPECT_TRUE(contacts->is_free({0.0, 0.0, -17.0}));
    EXPECT_FALSE(contacts->is_free({0.0, 0.0, -15.0})); // its top is 0.75 mm in
}

} // namespace
} // namespace palpate::haptics
