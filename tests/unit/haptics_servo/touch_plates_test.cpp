#include "haptics/field/touch_plates.h"

#include <gtest/gtest.h>

#include <random>

namespace palpate::haptics {
namespace {

// A plate in any place and turn: what is asked of it is asked in its own axes.
struct Pressed {
    TouchPlates plates;
    PlatePress press;
    double radius_mm = 2.0;

    explicit Pressed(uint32_t seed = 1) {
        std::mt19937 random(seed);
        std::normal_distribution<double> normal;
        const glm::dquat turn = glm::normalize(
            glm::dquat(normal(random), normal(random), normal(random), normal(random)));
        plates.plates = {{.top = {{40.0 * normal(random), 7.0, -3.0}, turn}}};
    }
    const TouchPlate& plate() const { return plates.plates.front(); }
    // The force in the plate's axes, with the ball's lowest point there.
    glm::dvec3 at(glm::dvec3 tip) {
        const ToolPose& top = plate().top;
        const glm::dvec3 tool =
            top.position_mm + top.rotation * (tip + glm::dvec3(0.0, 0.0, radius_mm));
        return glm::conjugate(top.rotation) * press.tick(&plates, tool, radius_mm);
    }
};

TEST(TouchPlates, PushBackAsASpringWithAStop) {
    for (uint32_t seed = 1; seed < 20; ++seed) {
        Pressed pressed(seed);
        EXPECT_EQ(pressed.at({3, 1, 0.5}), glm::dvec3(0.0));
        EXPECT_EQ(pressed.press.touch().plate, -1);
        for (double depth = 0.25; depth < 8.0; depth += 0.25) {
            const glm::dvec3 force = pressed.at({3, 1, -depth});
            // 300 N/m for 4 mm, then 1200 N/m.
            const double expected = 0.3 * std::min(depth, 4.0) + 1.2 * std::max(0.0, depth - 4.0);
            EXPECT_NEAR(force.z, expected, 1e-9);
            EXPECT_NEAR(glm::length(glm::dvec2(force)), 0.0, 1e-9);
            EXPECT_EQ(pressed.press.touch().plate, 0);
            EXPECT_NEAR(pressed.press.touch().depth_mm, depth, 1e-9);
            EXPECT_NEAR(pressed.press.touch().at_mm.x, 3.0, 1e-9);
        }
        EXPECT_EQ(pressed.at({3, 1, 0.5}), glm::dvec3(0.0));
    }
}

TEST(TouchPlates, AreNotFeltFromTheSideOrFromBehind) {
    Pressed pressed;
    pressed.at({20, 0, -2}); // beside it, below its face
    EXPECT_EQ(pressed.at({5, 0, -2}), glm::dvec3(0.0));
    EXPECT_EQ(pressed.at({5, 0, -1}), glm::dvec3(0.0));
    EXPECT_EQ(pressed.at({5, 0, 1}), glm::dvec3(0.0)); // out through its face: now it is above
    EXPECT_GT(pressed.at({5, 0, -1}).z, 0.0);
}

TEST(TouchPlates, HoldATipThatSlipsOverTheEdgeByALittle) {
    Pressed pressed;
    pressed.at({9, 0, 1});
    pressed.at({9, 0, -2});
    EXPECT_GT(pressed.at({11.9, 0, -2}).z, 0.0); // its edge is at 10
    EXPECT_EQ(pressed.at({12.1, 0, -2}), glm::dvec3(0.0));
    EXPECT_EQ(pressed.at({9, 0, -2}), glm::dvec3(0.0)); // it has come from the side
}

TEST(TouchPlates, AHandThatAppearsBelowAFaceFeelsNothing) {
    Pressed pressed;
    EXPECT_EQ(pressed.at({0, 0, -3}), glm::dvec3(0.0));
    EXPECT_EQ(pressed.press.tick(nullptr, {}, 1.0), glm::dvec3(0.0));
}

} // namespace
} // namespace palpate::haptics
