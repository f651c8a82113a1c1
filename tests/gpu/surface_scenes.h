#pragma once

#include <algorithm>
#include <random>
#include <span>

#include "engine/reference/twin.h"
#include "engine/scene/presets.h"
#include "engine/volume/synthetic.h"
#include "tests/gpu/gpu_fixture.h"
#include "tests/gpu/surface_meshes.h"

namespace palpate::testing_meshes {

// Scenes of meshes about a ball, and pictures of them beside the twin's.

constexpr double kBound = 2.8 * 0x1p-17 + 8 * 0x1p-17 + 0x1p-20;

// A ball of 20 mm in a box of 60 mm, on slices of uneven spacing.
inline Volume ball_volume() {
    const Grid grid = make_grid({61, 61, 21}, {1, 1, 3}, glm::dvec3(-30.0));
    return sample(synthetic::gaussian({}, 12.0), grid, ScalarType::f32);
}

inline SceneData data_with(std::vector<Mesh> meshes) {
    SceneData data{ball_volume(), std::nullopt, {}};
    for (Mesh& mesh : meshes)
        data.meshes.push_back(shared(std::move(mesh)));
    return data;
}

inline Scene scene_of(std::vector<SurfaceLayer> surfaces) {
    Scene scene;
    scene.size_px = {80, 72};
    scene.camera.eye_mm = {70.0, -150.0, 60.0};
    scene.background = {0.25, 0.125, 0.5};
    scene.value_and_depth = true;
    scene.surfaces = std::move(surfaces);
    return scene;
}

inline SurfaceLayer layer(glm::dvec3 color, double opacity = 1.0) {
    return {{color, opacity}, {}, {}, true};
}

inline void add_slices(Scene& scene) {
    scene.slice_transfer = window_function(0.0, 1000.0, 1.0);
    scene.slices = {SliceLayer{}, SliceLayer{{3.0, 0.0, 0.0}, {1.0, 0.3, 0.0}}};
}

inline void add_rays(Scene& scene, RayMode mode) {
    RayCastLayer rays;
    rays.mode = mode;
    rays.transfer = window_function(100.0, 1000.0, mode == RayMode::mip ? 1.0 : 0.05);
    rays.step_mm = 0.7;
    rays.min_transmittance = 0.0;
    rays.isos = {{400.0, {0.4, 0.9, 0.5}, 0.5}, {700.0}};
    scene.ray_cast = rays;
}

// Largest difference of samples that are neighbours along each axis.
inline glm::dvec3 steepest_on_axes(const Volume& volume) {
    glm::dvec3 most(0.0);
    const glm::uvec3 size = volume.size();
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x)
                for (int a = 0; a < 3; ++a) {
                    glm::uvec3 next(x, y, z);
                    if (++next[a] < size[a])
                        most[a] = std::max<double>(
                            most[a], std::abs(volume.value(next) - volume.value({x, y, z})));
                }
    return most;
}

// How far a pixel with ray casting may be off: what its rays may be (twin_test.cpp, exact_test.cpp)
// of the ball of ball_volume(), what its meshes may be, and what the places where meshes part the
// rays are worth.
inline double ray_bound(const Scene& scene, const SceneData& data) {
    const RayCastLayer& rays = *scene.ray_cast;
    const Grid& grid = data.volume.grid();
    const glm::dvec3 size(grid.size), eye = index_point(grid, scene.camera.eye_mm);
    const bool exact = rays.integrator == Integrator::exact;
    // A place: origin, direction, distance and their sum are rounded in texture coordinates, all
    // below twice the eye's own; the exact integrator works in samples from the entry on. A value:
    // that times the steepest difference on each axis, and the roundings of interpolation.
    double value = 10.0 * 0x1p-24 * 1000.0;
    const glm::dvec3 steep = steepest_on_axes(data.volume);
    for (int a = 0; a < 3; ++a)
        value += steep[a] * 0x1p-24 *
                 (exact ? 4.0 * (glm::length(eye) + glm::length(size)) + 10.0 * glm::length(size)
                        : 8.0 * size[a] * (1.0 + std::abs(eye[a]) / size[a]));
    // One entry further in the table, or with `exact` up to four and what the value is off.
    const TransferTable table = make_table(rays.transfer);
    double color = 0.0, tau = 0.0;
    for (size_t i = 1; i < table.entries.size(); ++i) {
        const glm::vec4 d = glm::abs(table.entries[i] - table.entries[i - 1]);
        color = std::max<double>(color, std::max({d.x, d.y, d.z}));
        tau = std::max<double>(tau, d.w);
    }
    const double entry = (table.high - table.low) / static_cast<double>(table.entries.size() - 1);
    const double entries =
        exact ? 4.0 + 2.0 * (value / entry + 1.0 / 256.0) : 1.0 + std::floor(value / entry);
    const double length_mm = glm::length(size * spacing_mm(grid));
    const double pieces = exact ? 3.0 * glm::length(size) : length_mm / rays.step_mm;
    const double slices = scene.slices.empty() ? 0.0 : 1.0 / 4095.0;
    const double meshes = kBound + slices;
    if (rays.mode == RayMode::mip)
        return meshes + 2.0 * entries * color; // of the colour, and of the opacity
    if (rays.mode == RayMode::alpha) {
        // A mesh's depth is good to 2^-20 of at most 200 mm, and as much again where it slants; up
        // to eight layers, one opaque mesh and two slices part a ray, at the densest tau a mm.
        const double parted = 11 * 2 * 200 * 0x1p-20 * table.entries.back().w;
        return meshes + entries * (color + tau * length_mm) + pieces * 0x1p-23 + parted;
    }
    // A normal: each of three differences of values over two spacings of at least 1 mm is off by
    // the value's error, over the gradient's length: v r / 12^2 where the Gaussian is v at r, of
    // which samples 3 mm apart leave nine tenths (3^2 / 12^2 = 1 / 16, times 1.5 at the most). The
    // place of a hit moves by value / slope, which turns the normal by that over the radius.
    double angle = 0.0;
    for (const IsoSurface& iso : rays.isos) {
        const double r = 12.0 * std::sqrt(2.0 * std::log(1000.0 / iso.value));
        const double slope = 0.9 * iso.value * r / 144.0;
        angle = std::max(angle, std::sqrt(3.0) * value / slope + value / slope / r);
    }
    const Shading shading;
    return meshes + (shading.diffuse + shading.specular * shading.shininess) * angle + 0x1p-20;
}

class SurfaceTest : public GpuTest {
 protected:
    // As a device that has no atomic operations on 64 bits.
    static GpuDevice& narrow_device() {
        static KeptForTests<GpuDevice>& kept =
            keep_device({.validation = true, .int64_atomics = false});
        return kept.get();
    }

    static std::vector<Image> drawn_on(GpuDevice& which, const Scene& scene, const SceneData& data,
                                       const RendererOptions& options) {
        Renderer renderer = kept_renderer(which, options);
        Result<Frame> frame = renderer.render(scene, data);
        EXPECT_TRUE(frame) << frame.error().message;
        return frame ? std::move(frame->eyes) : std::vector<Image>{};
    }

    // Without 64 bits at a time not a bit of the picture is another.
    static std::vector<Image> drawn(const Scene& scene, const SceneData& data,
                                    const RendererOptions& options = {}) {
        std::vector<Image> eyes = drawn_on(device(), scene, data, options);
        if (!device().has_int64_atomics())
            return eyes; // they are drawn so already
        EXPECT_FALSE(narrow_device().has_int64_atomics());
        const std::vector<Image> narrow = drawn_on(narrow_device(), scene, data, options);
        EXPECT_EQ(narrow.size(), eyes.size());
        for (size_t i = 0; i < std::min(eyes.size(), narrow.size()); ++i)
            EXPECT_TRUE(std::ranges::equal(std::as_bytes(std::span(eyes[i].samples)),
                                           std::as_bytes(std::span(narrow[i].samples))));
        EXPECT_TRUE(narrow_device().validation_messages().empty());
        return eyes;
    }

    static double difference(const Image& image, uint32_t x, uint32_t y, const PixelSample& twin) {
        double largest = 0.0;
        for (int c = 0; c < 4; ++c)
            largest = std::max(largest, std::abs(image.at(x, y, c) - twin.rgba[c]));
        const double depth = image.at(x, y, 5);
        if (std::isnan(depth) != std::isnan(twin.depth))
            return 1.0;
        // 2^-20 of the distance, and as much again across a slanted triangle.
        return std::isnan(depth) || std::abs(depth - twin.depth) <= 1e-4 * (1.0 + depth) ? largest
                                                                                         : 1.0;
    }

    // How many pixels are neither the twin's nor those of its rays close by.
    static void expect_like_twin(const Scene& scene, const SceneData& data, double bound = kBound) {
        const std::vector<Image> eyes = drawn(scene, data);
        size_t wrong = 0, doubtful = 0;
        double worst = 0.0;
        for (size_t eye = 0; eye < eyes.size(); ++eye) {
            const auto number = static_cast<int>(eye);
            const Image twin = render_twin(scene, data, number);
            for (uint32_t y = 0; y < scene.size_px.y; ++y)
                for (uint32_t x = 0; x < scene.size_px.x; ++x) {
                    PixelSample same;
                    for (int c = 0; c < 4; ++c)
                        same.rgba[c] = twin.at(x, y, c);
                    same.depth = twin.at(x, y, 5);
                    double least = difference(eyes[eye], x, y, same);
                    if (least > bound) {
                        ++doubtful;
                        for (int side = 0; side < 9 && least > bound; ++side) {
                            const glm::dvec2 beside(side % 3 - 1, side / 3 - 1);
                            const glm::dvec2 at = glm::dvec2(x, y) + beside / 256.0;
                            least = std::min(
                                least,
                                difference(eyes[eye], x, y, twin_pixel(scene, data, at, number)));
                        }
                    }
                    wrong += least > bound;
                    if (least <= bound)
                        worst = std::max(worst, least);
                }
        }
        std::printf("    bound %.1e, worst %.1e, %zu on edges, %zu wrong\n", bound, worst, doubtful,
                    wrong);
        EXPECT_EQ(wrong, 0u);
    }
};

inline bool same_bits(const std::vector<Image>& a, const std::vector<Image>& b) {
    bool same = a.size() == b.size();
    for (size_t eye = 0; same && eye < a.size(); ++eye)
        same = std::ranges::equal(std::as_bytes(std::span(a[eye].samples)),
                                  std::as_bytes(std::span(b[eye].samples)));
    return same;
}

} // namespace palpate::testing_meshes
