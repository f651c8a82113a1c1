#pragma once

#include <gtest/gtest.h>

#include <vector>

#include "bench/touch/open_loop.h"
#include "engine/volume/edit.h"
#include "haptics/field/field.h"
#include "haptics/proxy/algorithms.h"

namespace palpate::touch {

// Settings that a person would have made: the volume's own.
inline haptics::TouchParameters settings(const Scene& scene) {
    haptics::TouchParameters parameters = scene_parameters(scene);
    tune(parameters, *scene.touch.grey);
    return parameters;
}

// One tick as a test looks at it.
struct Seen {
    glm::dvec3 tool, proxy, force;
    haptics::Contact contact;
};

// Runs an algorithm by name along a path and keeps every tick.
struct Trace {
    Figures figures;
    std::vector<Seen> ticks;
};
inline Trace run_named(const char* name, const Scene& scene, const Path& path,
                       const haptics::TouchParameters& parameters) {
    const haptics::AlgorithmEntry* entry = haptics::find_algorithm(name);
    EXPECT_NE(entry, nullptr) << name;
    Trace run;
    if (!entry)
        return run;
    const auto algorithm = entry->make();
    run.figures =
        open_loop(*algorithm, scene, {.id = "", .name = "", .path = path}, parameters, false,
                  [&](const haptics::TickInput& input, const haptics::TickOutput& out) {
                      run.ticks.push_back({input.tool.position_mm, out.proxy.position_mm,
                                           out.force_n, out.contact});
                  });
    return run;
}

// Somebody else edits far away: one sample in a corner, another value each tick.
inline void edit_elsewhere(haptics::TouchScene& touch, int tick) {
    VolumeEdit edit(*touch.grey);
    edit.set({1, 1, 1}, tick % 2 ? 0.0 : 1000.0);
    touch.grey = edit.commit();
    touch.version = touch.grey->version();
}

inline TouchCase flat_plane() {
    TouchCase body{.id = "A1", .name = "plane"};
    body.solid = plane({0, 0, 0.13}, {0, 0, 1});
    body.touch_mm = {0, 0, 0.13};
    return body;
}

inline TouchCase flat_wall(double thickness_mm) {
    TouchCase body{.id = "A7", .name = "wall"};
    body.solid = slab({0, 0, 0.1}, {0, 0, 1}, thickness_mm, edge_mm({}));
    body.touch_mm = {0, 0, 0.1 + thickness_mm / 2};
    body.judge_jumps = false;
    return body;
}

} // namespace palpate::touch
