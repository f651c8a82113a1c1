#include <cmath>

#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"
#include "tests/support/hard_cases.h"

namespace palpate::hard_cases {

namespace {

// The modes with everything that has a place in space: camera, slices, clip planes.
std::vector<std::pair<std::string, Scene>> scenes_of_all_modes() {
    Scene base;
    base.size_px = {32, 32};
    base.background = {0.1, 0.2, 0.3};
    base.camera.eye_mm = {20.25, -40.5, 15.125}; // short in binary, so that adding 10^7 is exact
    base.camera.target_mm = {6.0, 6.0, 6.5};
    RayCastLayer layer;
    layer.step_mm = 0.5;
    layer.transfer = window_function(-1.5, 1.5, 0.3);

    std::vector<std::pair<std::string, Scene>> scenes;
    for (const Integrator integrator : {Integrator::fast, Integrator::preintegrated}) {
        Scene scene = base;
        scene.ray_cast = layer;
        scene.ray_cast->integrator = integrator;
        scene.ray_cast->shading = Shading{};
        scene.clip_planes = {{{4.0, 3.5, 2.0}, {1.0, 0.5, 0.25}}};
        scenes.emplace_back(integrator == Integrator::fast ? "alpha fast" : "alpha preintegrated",
                            scene);
    }
    Scene scene = base;
    scene.ray_cast = layer;
    scene.ray_cast->mode = RayMode::mip;
    scenes.emplace_back("mip", scene);
    scene.ray_cast->mode = RayMode::iso;
    scene.ray_cast->isos = {{-0.5, {1, 0.5, 0}, 0.5}, {0.5, {0, 0.5, 1}, 1.0}};
    scenes.emplace_back("iso", scene);
    scene.camera.projection = Projection::orthographic;
    scene.camera.view_height_mm = 16.0;
    scenes.emplace_back("iso orthographic", scene);
    scene = base;
    scene.slice_transfer = window_function(-1.5, 1.5, 1.0);
    scene.slices = {{{6.0, 6.0, 5.25}, {0.25, 0, 1}, Interpolation::cubic, 2.0, SlabMode::mean},
                    {{6.0, 6.0, 6.0}, {1, 0, 0}}};
    scenes.emplace_back("slices", scene);
    return scenes;
}

void move(Scene& scene, glm::dvec3 by) {
    scene.camera.eye_mm += by;
    scene.camera.target_mm += by;
    for (SliceLayer& slice : scene.slices)
        slice.point_mm += by;
    for (ClipPlane& plane : scene.clip_planes)
        plane.point_mm += by;
}

void scale(Scene& scene, double by) {
    scene.camera.eye_mm *= by;
    scene.camera.target_mm *= by;
    scene.camera.view_height_mm *= by;
    for (SliceLayer& slice : scene.slices) {
        slice.point_mm *= by;
        slice.slab_mm *= by;
    }
    for (ClipPlane& plane : scene.clip_planes)
        plane.point_mm *= by;
    if (scene.ray_cast) {
        scene.ray_cast->step_mm *= by;
        scene.ray_cast->transfer.opacity_unit_mm *= by;
    }
}

} // namespace

std::vector<Same> far_away_or_tiny() {
    const glm::uvec3 size(13, 13, 14);
    const Volume volume =
        synthetic::sample(synthetic::gyroid(8.0), make_grid(size, {1, 1, 1}), ScalarType::f32);
    std::vector<Same> cases;
    for (const auto& [name, scene] : scenes_of_all_modes()) {
        Same moved{name + ", moved by whole millimetres", {{scene, {volume, {}}}}, 0.0};
        for (const glm::dvec3 by :
             {glm::dvec3(1e3, 0, -1e3), glm::dvec3(-1e5, 1e5, 17), glm::dvec3(1e7, -1e7, 1e7)}) {
            Scene there = scene;
            move(there, by);
            const Grid grid = make_grid(size, {1, 1, 1}, by);
            moved.variants.push_back({there, {with_grid(volume, grid), {}}});
        }
        cases.push_back(std::move(moved));
        Same scaled{name + ", scaled by powers of two", {{scene, {volume, {}}}}, 0.0};
        for (const int power : {-20, -3, 1, 10}) {
            Scene other = scene;
            const double by = std::ldexp(1.0, power);
            scale(other, by);
            const Grid grid = make_grid(size, glm::dvec3(by));
            scaled.variants.push_back({other, {with_grid(volume, grid), {}}});
        }
        cases.push_back(std::move(scaled));
    }
    return cases;
}

std::vector<Same> bricks_at_all_phases() {
    // The same 13 mm of a gyroid, cut out by clip planes, in volumes whose brick borders (at sample
    // 32) pass through it at every phase. Volumes of 1, 2, 3 and 8 bricks.
    const double pad_mm[] = {0, 20, 22, 24, 26, 28, 30};
    const synthetic::Field gyroid = synthetic::gyroid(8.0);
    std::vector<Same> cases;
    for (const bool mip : {true, false})
        for (int axes = 1; axes <= 3; ++axes) {
            // Table entries are 1/4096 of the range apart; a value that rounding moves across the
            // middle between two changes colour by as much, weighted by one sample's opacity 0.15.
            Same same{fmt::format("gyroid, {}, borders on {} axes", mip ? "mip" : "alpha", axes),
                      {},
                      mip ? 3e-4 : 1e-4};
            for (const double pad : pad_mm) {
                glm::dvec3 before(0.0);
                for (int axis = 0; axis < axes; ++axis)
                    before[axis] = pad;
                const Grid grid = make_grid(glm::uvec3(before) + 16u, {1, 1, 1}, -before);
                Scene scene;
                scene.size_px = {24, 24};
                scene.camera.eye_mm = {30, -40, 21};
                scene.camera.target_mm = {7, 7, 7};
                scene.camera.view_angle_deg = 20.0;
                scene.ray_cast = RayCastLayer{};
                scene.ray_cast->mode = mip ? RayMode::mip : RayMode::alpha;
                scene.ray_cast->step_mm = 0.5;
                scene.ray_cast->transfer = window_function(-1.5, 1.5, 0.3);
                scene.clip_planes = {{{1, 1, 1}, {1, 0, 0}},     {{1, 1, 1}, {0, 1, 0}},
                                     {{1, 1, 1}, {0, 0, 1}},     {{14, 14, 14}, {-1, 0, 0}},
                                     {{14, 14, 14}, {0, -1, 0}}, {{14, 14, 14}, {0, 0, -1}}};
                same.variants.push_back(
                    {scene, {synthetic::sample(gyroid, grid, ScalarType::f32), {}}});
            }
            cases.push_back(std::move(same));
        }
    return cases;
}

} // namespace palpate::hard_cases
