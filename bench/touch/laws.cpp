#include "bench/touch/laws.h"

#include <algorithm>
#include <cmath>

#include "bench/touch/open_loop.h"
#include "engine/base/assert.h"
#include "engine/surface/marching_cubes.h"
#include "haptics/field/field.h"
#include "haptics/proxy/swept_mesh.h"

namespace palpate::touch {

namespace {

using glm::dvec3;

Scene law_scene() {
    TouchCase body{.id = "A1", .name = "plane"};
    body.solid = plane({0, 0, 0.13}, {0, 0, 1});
    body.touch_mm = {0, 0, 0.13};
    Scene scene = make_scene(body, {});
    scene.touch.mesh =
        std::make_shared<Mesh>(marching_cubes(*scene.touch.grey, static_cast<float>(scene.iso)));
    scene.touch.touch_mesh = haptics::make_touch_mesh(scene.touch.mesh, 1.0);
    return scene;
}

double across(dvec3 force) {
    return std::hypot(force.x, force.y);
}

// Straight on by one point a tick.
void move_to(Path& path, dvec3 to, size_t ticks) {
    const dvec3 from = path.back();
    for (size_t i = 1; i <= ticks; ++i)
        path.push_back(glm::mix(from, to, static_cast<double>(i) / static_cast<double>(ticks)));
}

} // namespace

Laws laws_of(const haptics::AlgorithmEntry& entry) {
    const Scene scene = law_scene();
    const double radius_mm =
        entry.takes(haptics::kTakesSamples) ? 1.5 * voxel_mm(scene.storage) : 0.0;
    const dvec3 on = scene.body.touch_mm + radius_mm * scene.body.normal;
    haptics::TouchParameters parameters = scene_parameters(scene);
    haptics::tune(parameters, *scene.touch.grey);
    parameters.tool_radius_mm = radius_mm;
    parameters.surface_delay_s = 0.002;      // of a local surface: as fast as it may be
    parameters.transfer[0].strength_n = 1e3; // motion rules: a surface, and no more
    const auto algorithm = entry.make();
    const auto run = [&](const Path& path, const auto& watch) {
        return open_loop(*algorithm, scene, {.path = path}, parameters, false, watch);
    };
    const auto nobody = [](const haptics::TickInput&, const haptics::TickOutput&) {};
    Laws laws;

    // Whole steps of 0.2 mm, with the surface and the deepest point on a step.
    constexpr double kDepth_mm = 4.0, kSpeed_mm_s = 200.0;
    const Path in_and_out = [&] {
        Path path{on + dvec3(0, 0, 2.0)};
        move_to(path, on - dvec3(0, 0, kDepth_mm), 30);
        move_to(path, on + dvec3(0, 0, 2.0), 30);
        return path;
    }();
    const Figures pressed = run(in_and_out, nobody);
    if (pressed.contact_ticks == 0 || pressed.largest_force_n < 0.5)
        return laws; // feels no plane
    laws.energy_beyond_mj = pressed.energy_mj - 1.0 * kSpeed_mm_s * kTick_s * kDepth_mm;

    parameters.friction_static = parameters.friction_dynamic = kLawFriction;
    Path sliding{on + dvec3(0, 0, 1.0)};
    move_to(sliding, on - dvec3(0, 0, 2.0), 100);
    move_to(sliding, on + dvec3(6, 2, -2.0), 600);
    laws.friction_share = 0.0;
    run(sliding, [&](const haptics::TickInput&, const haptics::TickOutput& out) {
        if (out.force_n.z > 0.5)
            laws.friction_share =
                std::max(laws.friction_share, across(out.force_n) / out.force_n.z);
    });
    if (laws.friction_share > 0.0) {
        Path sticking{on + dvec3(0, 0, 1.0)};
        move_to(sticking, on - dvec3(0, 0, 2.0), 100);
        move_to(sticking, on + dvec3(0.5 * kLawFriction * 2.0, 0, -2.0), 100);
        const size_t begin = sticking.size() + 100;
        sticking.insert(sticking.end(), 1100, dvec3(sticking.back()));
        size_t tick = 0;
        dvec3 first{}, last{};
        run(sticking, [&](const haptics::TickInput&, const haptics::TickOutput& out) {
            if (++tick == begin)
                first = out.proxy.position_mm;
            last = out.proxy.position_mm;
        });
        laws.stick_drift_um_s = 1e3 * glm::distance(first, last);
    }
    parameters.friction_static = parameters.friction_dynamic = 0.0;

    parameters.yield_n = kLawYield_n;
    parameters.transfer[0].strength_n = kLawYield_n;
    Path yielding{on + dvec3(0, 0, 1.0)};
    move_to(yielding, on - dvec3(0, 0, 1.9), 145);
    const size_t at_below = yielding.size() + 50;
    yielding.insert(yielding.end(), 50, dvec3(yielding.back()));
    move_to(yielding, on - dvec3(0, 0, 4.0), 105);
    yielding.insert(yielding.end(), 300, dvec3(yielding.back()));
    size_t tick = 0;
    run(yielding, [&](const haptics::TickInput&, const haptics::TickOutput& out) {
        if (++tick == at_below)
            laws.below_yield_share = glm::length(out.force_n) / 1.9;
        laws.yield_share = glm::length(out.force_n) / kLawYield_n;
    });
    parameters.yield_n = 0.0;
    parameters.transfer[0].strength_n = 1e3;

    const haptics::DevicePreset* falcon = haptics::find_device_preset("falcon");
    PALPATE_ASSERT(falcon);
    TouchCase held_body = scene.body;
    held_body.touch_mm = on;
    Path held = press(held_body, 40.0, 3.0, 1.2);
    held.resize(held.size() - 125); // up to the end of the hold
    laws.limit_cycle_um =
        1e3 * closed_loop(*algorithm, scene, held, parameters, {.device = falcon, .hand = {}})
                  .limit_cycle_mm;
    return laws;
}

} // namespace palpate::touch
