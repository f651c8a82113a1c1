#pragma once

#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "engine/edit/shape.h"
#include "engine/volume/builder.h"
#include "haptics/field/field.h"
#include "haptics/proxy/algorithms.h"
#include "haptics/proxy/swept_mesh.h"
#include "haptics/proxy/tool_points.h"
#include "haptics/proxy/yielding.h"

// A hand presses, and rests while edits change what it touches to anything: the statuses follow one
// another in any order, and the force goes from one to the next by the rate of edits.
namespace palpate::haptics {

// An edit may leave these: the surface where it was, higher, lower, tilted; nothing; matter
// everywhere; no data around the hand, or anywhere.
enum class Left { surface, higher, lower, tilted, nothing, matter, gap, no_data };
constexpr uint32_t kLefts = 8;

struct StatusCase {
    const char* algorithm = "swept-point";
    TouchSource source = TouchSource::grey;
    double radius_mm = 0.0;
    bool is_capsule = false; // of that radius, across the surface, and not about its middle
    double hertz = 1000.0, yield_n = 0.0, friction = 0.0;
    uint64_t seed = 0;
};
inline std::string name_of(const StatusCase& c) {
    return std::string(c.algorithm) + (c.source == TouchSource::labels ? ", labels" : ", grey") +
           ", radius " + std::to_string(c.radius_mm) + (c.is_capsule ? " mm, capsule, " : " mm, ") +
           std::to_string(int(c.hertz)) + " Hz, T0 " + std::to_string(c.yield_n) + ", friction " +
           std::to_string(c.friction) + ", seed " + std::to_string(c.seed);
}

struct StatusRun {
    std::set<std::pair<Contact, Contact>> changes;           // from, to
    double most_change_n = 0.0, most_torque_change_nm = 0.0; // in a tick, beyond the rate
    double most_n = 0.0, most_nm = 0.0, reach_mm = 0.0;
    Contact from = Contact::free, to = Contact::free; // at the largest change
    bool is_finite = true;
};

// The volumes, one of each. Solid is below the surface.
struct StatusScenes {
    static constexpr uint32_t kSamples = 40;
    static constexpr double kSpacing_mm = 0.5, kHalf_mm = 9.75;
    std::vector<Volume> grey, labels;
    std::vector<std::shared_ptr<const TouchMesh>> meshes; // of grey, where asked for

    StatusScenes() {
        for (uint32_t left = 0; left < kLefts; ++left)
            for (const bool is_labels : {false, true})
                (is_labels ? labels : grey).push_back(make(static_cast<Left>(left), is_labels));
    }
    static Volume make(Left left, bool is_labels) {
        const Grid grid =
            make_grid(glm::uvec3(kSamples), glm::dvec3(kSpacing_mm), glm::dvec3(-kHalf_mm));
        return make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
            const glm::dvec3 p = glm::dvec3(i) * kSpacing_mm - kHalf_mm;
            double d = p.z;
            if (left == Left::higher)
                d = p.z - 1.1;
            if (left == Left::lower)
                d = p.z + 0.7;
            if (left == Left::tilted)
                d = 0.8 * p.z - 0.6 * p.x;
            if (left == Left::nothing || left == Left::matter)
                d = left == Left::nothing ? 50.0 : -50.0;
            if (left == Left::no_data || (left == Left::gap && std::abs(p.x) < 2.0))
                return std::numeric_limits<double>::quiet_NaN();
            return is_labels ? (d < 0.0 ? 1.0 : 0.0)
                             : 500.0 * std::erfc(d / (std::sqrt(2.0) * 0.35));
        });
    }
};

inline StatusRun change_statuses(const StatusCase& c, StatusScenes& scenes, int edits) {
    std::mt19937_64 random(c.seed * 6151 + 3);
    const auto within = [&](double low, double high) {
        return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    TouchParameters q{.iso = 500.0,
                      .tool_radius_mm = c.radius_mm,
                      .stiffness_n_per_m = within(500.0, 1500.0),
                      .friction_static = c.friction,
                      .friction_dynamic = c.friction,
                      .yield_n = c.yield_n,
                      .source = c.source};
    q.normal_blur_samples = 0.6;
    q.edge_samples = 0.7;
    const bool is_labels = c.source == TouchSource::labels;
    const std::vector<Volume>& volumes = is_labels ? scenes.labels : scenes.grey;
    TouchScene scene{.version = 1};
    (is_labels ? scene.labels : scene.grey) = volumes[0];
    if (std::string_view(c.algorithm) == "swept-mesh") {
        if (scenes.meshes.empty())
            for (const Volume& volume : scenes.grey)
                scenes.meshes.push_back(
                    make_touch_mesh(std::make_shared<const Mesh>(touch_surface(volume, q)), 0.25));
        scene.touch_mesh = scenes.meshes[0];
    }
    StatusRun run;
    double& reach_mm = run.reach_mm;
    reach_mm = c.radius_mm;
    if (c.is_capsule) {
        const double length_mm = 3.0 * c.radius_mm;
        scene.tool =
            std::make_shared<ToolPoints>(sample_tool(*make_capsule(c.radius_mm, length_mm), 300));
        reach_mm += length_mm;
    }
    const std::unique_ptr<Algorithm> algorithm = find_algorithm(c.algorithm)->make();
    const double dt = 1.0 / c.hertz, depth_mm = within(0.3, 2.5);
    // A capsule leans, so that its contact has a lever.
    const double lean = c.is_capsule ? within(0.3, 1.2) : 0.0;
    TickInput input{.dt_s = dt, .scene = &scene, .parameters = &q};
    input.tool.rotation = glm::dquat(std::cos(lean / 2.0), 0.0, std::sin(lean / 2.0), 0.0);
    const glm::dvec3 rests(within(-0.3, 0.3), within(-0.3, 0.3), c.radius_mm - depth_mm);
    const glm::dvec3 begins = rests + glm::dvec3(within(-1.0, 1.0), 0.5, depth_mm + 1.0);
    const double press_s = within(0.01, 0.1);

    glm::dvec3 last_n(0.0), last_nm(0.0);
    Contact last = Contact::free;
    const auto tick = [&](glm::dvec3 x, bool is_counted) {
        input.velocity_mm_per_s = (x - input.tool.position_mm) / dt;
        input.tool.position_mm = x;
        const TickOutput out = algorithm->tick(input);
        run.is_finite = run.is_finite && std::isfinite(glm::length(out.force_n)) &&
                        std::isfinite(glm::length(out.torque_nm));
        const double rate_n = Yielding::kRate_n_per_s * dt;
        if (is_counted) {
            const double change_n = glm::distance(out.force_n, last_n) - rate_n;
            if (change_n > run.most_change_n) {
                run.most_change_n = change_n;
                run.from = last;
                run.to = out.contact;
            }
            run.most_torque_change_nm =
                std::max(run.most_torque_change_nm,
                         glm::distance(out.torque_nm, last_nm) - 1e-3 * reach_mm * rate_n);
            if (out.contact != last)
                run.changes.insert({last, out.contact});
        }
        run.most_n = std::max(run.most_n, glm::length(out.force_n));
        run.most_nm = std::max(run.most_nm, glm::length(out.torque_nm));
        last = out.contact;
        last_n = out.force_n;
        last_nm = out.torque_nm;
    };
    input.tool.position_mm = begins;
    algorithm->reset(input);
    for (double t = 0.0; t < press_s; t += dt)
        tick(glm::mix(begins, rests, t / press_s), false);
    // The first ticks at rest still have the velocity and the lag of the way.
    for (double t = 0.0; t < 0.1; t += dt)
        tick(rests, false);
    for (int edit = 0; edit < edits; ++edit) {
        const uint32_t left = random() % kLefts;
        (is_labels ? scene.labels : scene.grey) = volumes[left];
        if (scene.touch_mesh)
            scene.touch_mesh = scenes.meshes[left];
        ++scene.version;
        for (double t = within(0.002, 0.25); t > 0.0; t -= dt)
            tick(rests, true);
    }
    return run;
}

} // namespace palpate::haptics
