#pragma once

#include <algorithm>
#include <cmath>

#include "engine/volume/builder.h"
#include "tests/unit/haptics_proxy/run.h"

namespace palpate::touch {

// Hands stay within 11 mm of the middle on each axis (trajectories.cpp), so within 19.1 mm of it,
// and so do their projections to a plane through the middle; a proxy on its way there steps 4 of
// the smallest spacings beyond at most. In a volume that reaches 16 mm such a way leads round the
// rim of a flat wall; in one that reaches so far none does.
constexpr double kNoWayRound_mm = 26.0;

// A wall as make_scene() stores it, in a volume of another size.
inline Scene make_walled_scene(const TouchCase& wall, const Storage& storage, double reach_mm) {
    Scene scene{.body = wall, .storage = storage};
    const bool labels = storage.form == Form::labels;
    const Grid grid = make_grid(
        glm::uvec3(glm::ceil(2.0 * reach_mm / storage.spacing_mm) + 1.0), storage.spacing_mm,
        glm::dvec3(-reach_mm) + 0.37 * storage.spacing_mm * glm::dvec3(1, 0.6, 0.8));
    const double edge = edge_mm(storage);
    const Volume volume =
        make_volume(grid, labels ? ScalarType::u8 : ScalarType::f32, [&](glm::uvec3 index) {
            const double share = wall.solid.density(world_point(grid, glm::dvec3(index)), edge);
            return labels ? std::round(share) : 1000.0 * share;
        });
    (labels ? scene.touch.labels : scene.touch.grey) = volume;
    scene.iso = labels ? 0.5 : 500.0;
    scene.touch.version = 1;
    return scene;
}

inline haptics::TouchParameters wall_settings(const Scene& scene) {
    haptics::TouchParameters parameters = scene_parameters(scene);
    if (scene.touch.labels)
        parameters.source = haptics::TouchSource::labels;
    else
        tune(parameters, *scene.touch.grey);
    return parameters;
}

// The walls of the plan that may not be passed: 1.5 voxels and more.
inline std::vector<TouchCase> walls_of(const Storage& storage) {
    std::vector<TouchCase> walls;
    for (const TouchCase& wall : touch_cases(storage, true))
        if (wall.id == "A7" && !wall.name.ends_with("/1voxels"))
            walls.push_back(wall);
    return walls;
}

// How often a proxy is on another side of the wall than it was when last it was out of it.
struct Passes {
    uint64_t ticks = 0, passes = 0, not_finite = 0;
    glm::dvec3 from{0.0}, to{0.0}; // of the last of them
};
inline void count_passes(haptics::Algorithm& algorithm, const Scene& scene, const Path& path,
                         const haptics::TouchParameters& parameters, Passes& found) {
    haptics::TickInput input{.scene = &scene.touch, .parameters = &parameters};
    input.tool.position_mm = path.front();
    algorithm.reset(input);
    glm::dvec3 before = path.front();
    int part = scene.body.solid.part(before);
    for (const glm::dvec3 x : path) {
        input.velocity_mm_per_s = (x - input.tool.position_mm) / kTick_s;
        input.tool.position_mm = x;
        const haptics::TickOutput out = algorithm.tick(input);
        const glm::dvec3 proxy = out.proxy.position_mm;
        const int now = scene.body.solid.part(proxy);
        ++found.ticks;
        found.not_finite += !(glm::length(proxy) < 1e3 && glm::length(out.force_n) < 1e6);
        if (now >= 0 && now != part) {
            ++found.passes;
            found.from = before;
            found.to = proxy;
            part = now;
        }
        before = proxy;
    }
}

} // namespace palpate::touch
