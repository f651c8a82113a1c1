#pragma once

#include <algorithm>
#include <cmath>

#include "tests/unit/haptics_proxy/run.h"

namespace palpate::touch {

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
