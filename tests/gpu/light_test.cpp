// Lights apart from the eye, and ambient occlusion: the GPU against its twin in double.

#include <cmath>

#include "engine/reference/twin.h"
#include "engine/volume/builder.h"
#include "engine/volume/grid.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

// A ball of 14 mm over a floor, with a hole: values are mm into the material, so that the slope is
// 1 but along creases. Uneven and turned samples.
SceneData ball_on_floor() {
    Grid grid = make_grid({72, 60, 30}, {0.8, 1.0, 2.0}, {-29, -30, -22});
    const double angle = 0.4;
    grid.world_from_index =
        glm::dmat4({std::cos(angle), std::sin(angle), 0, 0},
                   {-std::sin(angle), std::cos(angle), 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}) *
        grid.world_from_index;
    return {make_volume(grid, ScalarType::f32,
                        [&](glm::uvec3 i) {
                            const glm::dvec3 p = world_point(grid, glm::dvec3(i));
                            const double ball = 14.0 - glm::length(p - glm::dvec3(0, 0, 4));
                            const double hole = glm::length(p - glm::dvec3(6, -14, 6)) - 7.0;
                            return std::max(std::min(ball, hole), -8.0 - p.z);
                        }),
            std::nullopt};
}

Scene scene_of(const SceneData& data, RayMode mode) {
    Scene scene;
    scene.size_px = {72, 64};
    scene.camera = frame_volume(data.volume.grid(), {-0.45, -1.0, 0.6}, {0, 0, 1});
    RayCastLayer layer;
    layer.mode = mode;
    layer.isos = {{0.0, {0.9, 0.8, 0.6}}};
    layer.transfer = {{{-4.0, {0.9, 0.7, 0.5}}}, {{-2.0, 0.0}, {0.0, 0.05}}};
    layer.shading = Shading{};
    layer.min_transmittance = 0.0;
    layer.step_mm = 0.5;
    scene.ray_cast = layer;
    return scene;
}

// Values err as in twin_test.cpp: the position by 8 roundings of texture coordinates up to twice
// as far as the eye, times the steepest difference of neighbours, which is the spacing here.
double value_error(const Scene& scene, const SceneData& data) {
    const Grid& grid = data.volume.grid();
    const glm::dvec3 eye = index_point(grid, scene.camera.eye_mm), size(grid.size);
    double farthest = 1.0;
    for (int axis = 0; axis < 3; ++axis)
        farthest = std::max(farthest, 1.0 + std::abs(eye[axis] / size[axis]));
    return 3.0 * std::max({size.x, size.y, size.z}) * farthest * 8.0 * 0x1p-24 * 2.0;
}

// A difference of two values over two samples of 0.8 mm or more, where the slope is at least a
// half: its angle. Light, half vector and the fading highlight change by no more.
double light_error(const Scene& scene, const SceneData& data) {
    const double angle = std::sqrt(3.0) * value_error(scene, data) / 0.8 / 0.5;
    return (0.65 + 0.15 * (8.0 + 10.0)) * angle + 0x1p-20;
}

class LightTest : public GpuTest {
 protected:
    // The share of pixels in which a channel differs by more than a bound.
    static double share_beyond(const Scene& scene, const SceneData& data, double bound) {
        Renderer renderer(device(), {});
        const Result<Frame> frame = renderer.render(scene, data);
        EXPECT_TRUE(frame) << frame.error().message;
        const Image& gpu = frame->eyes[0];
        const Image twin = render_twin(scene, data);
        size_t beyond = 0;
        double worst = 0.0;
        for (uint32_t y = 0; y < gpu.size_px.y; ++y)
            for (uint32_t x = 0; x < gpu.size_px.x; ++x) {
                double most = 0.0;
                for (size_t c = 0; c < 4; ++c)
                    most = std::max<double>(most, std::abs(gpu.at(x, y, c) - twin.at(x, y, c)));
                beyond += !(most <= bound);
                worst = std::max(worst, most);
            }
        const double share = double(beyond) / (gpu.size_px.x * gpu.size_px.y);
        std::printf("    bound %.1e, worst %.1e, beyond %.4f\n", bound, worst, share);
        return share;
    }
    // How far two pictures of the GPU are apart on the mean.
    static double mean_change(const Scene& a, const Scene& b, const SceneData& data) {
        Renderer renderer(device(), {});
        const Image first = renderer.render(a, data)->eyes[0];
        const Image second = renderer.render(b, data)->eyes[0];
        double sum = 0.0;
        for (uint32_t y = 0; y < first.size_px.y; ++y)
            for (uint32_t x = 0; x < first.size_px.x; ++x)
                sum += std::abs(first.at(x, y, 0) - second.at(x, y, 0));
        return sum / (first.size_px.x * first.size_px.y);
    }
};

// Silhouettes apart, where one of the two may miss a grazing ray or take the other side of a normal
// across it: as in twin_test.cpp, a hundredth of the pixels.
TEST_F(LightTest, IsoIsTheTwins) {
    const SceneData data = ball_on_floor();
    for (const Integrator integrator : {Integrator::fast, Integrator::exact}) {
        Scene scene = scene_of(data, RayMode::iso);
        const Scene plain = scene;
        scene.ray_cast->integrator = integrator;
        scene.ray_cast->light = Light{-50.0, 30.0};
        EXPECT_LE(share_beyond(scene, data, light_error(scene, data)), 0.01);
        EXPECT_GT(mean_change(plain, scene, data), 0.02);
        // Caps by their plane's normal.
        scene.clip_planes = {{{0, -4, 0}, {0.2, 1, -0.1}}};
        EXPECT_LE(share_beyond(scene, data, light_error(scene, data)), 0.01);
    }
}

// Each sample errs by its light, weighted with what it hides: at most the whole.
TEST_F(LightTest, AlphaIsTheTwins) {
    const SceneData data = ball_on_floor();
    for (const Integrator integrator : {Integrator::fast, Integrator::preintegrated}) {
        Scene scene = scene_of(data, RayMode::alpha);
        scene.ray_cast->integrator = integrator;
        const Scene plain = scene;
        scene.ray_cast->light = Light{70.0, 10.0};
        // Creases between ball, hole and floor, where the slope is smaller, are few.
        EXPECT_LE(share_beyond(scene, data, light_error(scene, data) + 1e-3), 0.02);
        EXPECT_GT(mean_change(plain, scene, data), 0.02);
    }
}

// A place errs by its value's error and by that of where the directions begin, over the fall; the
// weights by the normal's angle.
TEST_F(LightTest, AmbientOcclusionIsTheTwins) {
    const SceneData data = ball_on_floor();
    for (const double radius_mm : {4.0, 16.0}) {
        Scene scene = scene_of(data, RayMode::iso);
        const Scene plain = scene;
        scene.ray_cast->occlusion_mm = radius_mm;
        const double value = value_error(scene, data), fall = radius_mm / 16.0;
        const double angle = std::sqrt(3.0) * value / 0.8 / 0.5;
        const double bound =
            (3.0 * value + fall * angle) / (0.5 * fall) + 2.0 * angle + light_error(scene, data);
        EXPECT_LE(share_beyond(scene, data, bound), 0.01) << radius_mm;
        EXPECT_GT(mean_change(plain, scene, data), 0.001); // hollows are few
        scene.ray_cast->light = Light{-50.0, 30.0};
        scene.clip_planes = {{{0, -4, 0}, {0.2, 1, -0.1}}};
        EXPECT_LE(share_beyond(scene, data, bound), 0.01) << radius_mm;
    }
}

TEST_F(LightTest, AmbientOcclusionOfBricksIsRefused) {
    const SceneData data = ball_on_floor();
    Scene scene = scene_of(data, RayMode::iso);
    scene.ray_cast->occlusion_mm = 4.0;
    Renderer renderer(device(), {.residency = Residency::atlas});
    const Result<Frame> frame = renderer.render(scene, data);
    ASSERT_FALSE(frame);
    EXPECT_NE(frame.error().message.find("ambient occlusion: expected a volume that lies in one"),
              std::string::npos)
        << frame.error().message;
}

} // namespace
} // namespace palpate
