// Minimum intensity projections: mode mip by a function whose opacity falls.

#include <cmath>

#include "engine/reference/twin.h"
#include "engine/volume/builder.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

double noise(glm::uvec3 at) {
    const uint32_t h = (at.x * 73856093u ^ at.y * 19349663u ^ at.z * 83492791u) * 2654435761u;
    return (h >> 8) * 0x1p-24;
}

// White and opaque for the smallest value.
TransferFunction falling(double low, double high) {
    return {{{low, glm::dvec3(1.0)}, {high, glm::dvec3(0.0)}}, {{low, 1.0}, {high, 0.0}}, 1.0};
}

// Noise with gaps, in two bricks a side.
class MinimumProjection : public GpuTest {
 protected:
    static Image drawn(const Scene& scene, const Volume& volume, RendererOptions options = {}) {
        Renderer renderer(device(), std::move(options));
        return renderer.render(scene, {volume, std::nullopt, {}}).value().eyes.front();
    }
    MinimumProjection() {
        scene.size_px = {64, 56};
        scene.camera = frame_volume(volume().grid(), {-0.45, -1.0, 0.4}, {0, 0, 1}, 0.7);
        scene.value_and_depth = true;
        scene.ray_cast = RayCastLayer{};
        scene.ray_cast->mode = RayMode::mip;
        scene.ray_cast->transfer = falling(0.0, 1.0);
    }
    static Volume volume(double sign = 1.0) {
        return make_volume(make_grid({40, 36, 50}, {1, 1.5, 1}), ScalarType::f32,
                           [=](glm::uvec3 at) {
                               return glm::length(glm::dvec3(at) - 20.0) < 5.0
                                          ? NAN
                                          : sign * (0.2 * noise(at) + 0.015 * at.z);
                           });
    }
    Scene scene;
};

// A device rounds positions to some 2^-8 of a sample, between which values differ by 0.2: 1e-3.
TEST_F(MinimumProjection, IsThatOfTheTwinAndTheMaximumOfTheNegativeValues) {
    for (const Integrator integrator : {Integrator::fast, Integrator::exact}) {
        scene.ray_cast->integrator = integrator;
        scene.ray_cast->transfer = falling(0.0, 1.0);
        const Image found = drawn(scene, volume());
        const Image twin = render_twin(scene, {volume(), std::nullopt, {}});
        Scene turned = scene;
        turned.ray_cast->transfer = window_function(-1.0, 0.0, 1.0);
        const Image negative = drawn(turned, volume(-1.0));
        size_t beyond = 0, shown = 0;
        for (uint32_t y = 0; y < scene.size_px.y; ++y)
            for (uint32_t x = 0; x < scene.size_px.x; ++x) {
                const double value = double{found.at(x, y, 4)};
                EXPECT_EQ(std::isnan(value), std::isnan(negative.at(x, y, 4)));
                if (std::isnan(value))
                    continue;
                ++shown;
                ASSERT_EQ(value, -double{negative.at(x, y, 4)});
                beyond += !(std::abs(value - double{twin.at(x, y, 4)}) < 1e-3 &&
                            std::abs(double{found.at(x, y, 0)} - double{twin.at(x, y, 0)}) < 2e-3);
            }
        EXPECT_GT(shown, size_t{1000});
        EXPECT_LE(beyond, shown / 50); // at the rim of the box and of the gap
    }
}

TEST_F(MinimumProjection, IsTheSameWhereSpaceIsSkippedAndInBricks) {
    for (const Integrator integrator : {Integrator::fast, Integrator::exact}) {
        scene.ray_cast->integrator = integrator;
        const Image skipping = drawn(scene, volume());
        EXPECT_EQ(skipping.samples.size(),
                  drawn(scene, volume(), {.skipping = false}).samples.size());
        const Image all = drawn(scene, volume(), {.skipping = false});
        for (size_t i = 0; i < all.samples.size(); ++i)
            ASSERT_TRUE(skipping.samples[i] == all.samples[i] ||
                        (std::isnan(skipping.samples[i]) && std::isnan(all.samples[i])));
        const Image bricks =
            drawn(scene, volume(), {.residency = Residency::atlas, .sampling = Sampling::by_hand});
        const Image dense = drawn(scene, volume(), {.sampling = Sampling::by_hand});
        for (size_t i = 0; i < all.samples.size(); ++i)
            ASSERT_TRUE(bricks.samples[i] == dense.samples[i] ||
                        (std::isnan(bricks.samples[i]) && std::isnan(dense.samples[i])));
    }
}

// A renderer that has drawn the one draws the other.
TEST_F(MinimumProjection, FollowsTheFunction) {
    Renderer renderer(device());
    const SceneData data{volume(), std::nullopt, {}};
    Scene rising = scene;
    rising.ray_cast->transfer = window_function(0.0, 1.0, 1.0);
    const Image first = renderer.render(rising, data).value().eyes.front();
    const Image second = renderer.render(scene, data).value().eyes.front();
    const Image third = renderer.render(rising, data).value().eyes.front();
    for (size_t i = 0; i < first.samples.size(); ++i)
        ASSERT_TRUE(first.samples[i] == third.samples[i] || std::isnan(first.samples[i]));
    const size_t middle = (28 * 64 + 20) * 6 + 4;
    EXPECT_LT(second.samples[middle], first.samples[middle]);
}

} // namespace
} // namespace palpate
