#pragma once

#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <string>

#include "engine/surface/marching_cubes.h"
#include "engine/volume/builder.h"
#include "haptics/field/field.h"
#include "haptics/proxy/algorithms.h"
#include "haptics/proxy/swept_mesh.h"

// Presses into material that yields, over where its T0 is stated, bodies, radii and rates. No force
// is larger than T0; where the press is deep enough, none stays below it.
namespace palpate::haptics {

// The place where T0 is stated. `label_*`: with another one of the parameters, which that label
// does not have. `unlisted`: the parameters', beside another label's own.
enum class T0From { parameters_grey, parameters, label, label_softer, label_harder, unlisted };
constexpr T0From kAllT0[] = {T0From::parameters_grey, T0From::parameters,   T0From::label,
                             T0From::label_softer,    T0From::label_harder, T0From::unlisted};
constexpr const char* kT0Names[] = {"parameters, grey", "parameters",    "label",
                                    "label, softer",    "label, harder", "not listed"};

struct PressBody {
    const char* name;
    double reach_mm; // of its surface from the origin, at most
    std::function<double(glm::dvec3)> distance;
};

// Signed distances, turned by seed; all about the origin.
inline PressBody press_body(uint32_t kind, uint64_t seed) {
    std::mt19937_64 random(seed);
    const auto one = [&] { return 2.0 * static_cast<double>(random() >> 11) * 0x1p-53 - 1.0; };
    const glm::dvec3 x = glm::normalize(glm::dvec3(1.5 + one(), one(), one()));
    const glm::dvec3 y = glm::normalize(glm::cross(x, glm::dvec3(one(), 0.3, 1.5)));
    const glm::dmat3 turn = glm::transpose(glm::dmat3(x, y, glm::cross(x, y)));
    switch (kind) {
        case 0:
            return {"half space", 0.0, [=](glm::dvec3 p) { return (turn * p).z; }};
        case 1:
            return {
                "box", 4.5, [=](glm::dvec3 p) {
                    const glm::dvec3 q = glm::abs(turn * p) - glm::dvec3(2.5, 4.0, 3.0);
                    return glm::length(glm::max(q, 0.0)) + std::min(0.0, std::max({q.x, q.y, q.z}));
                }};
        case 2:
            return {"ball", 4.0, [](glm::dvec3 p) { return glm::length(p) - 4.0; }};
        case 3:
            return {"plate", 0.5, [=](glm::dvec3 p) { return std::abs((turn * p).z) - 0.5; }};
        case 4:
            return {"small ball", 1.2, [](glm::dvec3 p) { return glm::length(p) - 1.2; }};
        default: // with walls of 27 degrees, which a ball of 6 mm fits into above the start
            return {"groove", 0.0, [=](glm::dvec3 p) {
                        const glm::dvec3 q = turn * p;
                        return (q.z - 0.5 * std::abs(q.x)) / std::hypot(1.0, 0.5);
                    }};
    }
}
constexpr uint32_t kPressBodies = 6;

struct PressCase {
    const char* algorithm = "swept-tool";
    T0From from = T0From::label;
    uint32_t body = 0;
    double radius_mm = 0.0, hertz = 1000.0;
    uint64_t seed = 0;
};

inline std::string name_of(const PressCase& c) {
    return std::string(c.algorithm) + ", T0 of " + kT0Names[size_t(c.from)] + ", " +
           press_body(c.body, c.seed).name + ", radius " + std::to_string(c.radius_mm) + " mm, " +
           std::to_string(int(c.hertz)) + " Hz, seed " + std::to_string(c.seed);
}

struct Pressed {
    double t0_n = 0.0, most_n = 0.0; // the largest force
    double asked_n = 0.0;            // of the spring at the deepest, without T0
    bool is_finite = true;
};

// Volumes and meshes of bodies are made once.
struct PressScenes {
    std::map<std::pair<uint32_t, uint64_t>, Volume> labels, grey;
    std::map<std::pair<uint32_t, uint64_t>, std::shared_ptr<const TouchMesh>> meshes;

    static constexpr double kSpacing_mm = 0.5, kHalf_mm = 11.75;
    const Volume& volume(const PressCase& c, bool is_labels) {
        auto& made = is_labels ? labels : grey;
        const auto found = made.find({c.body, c.seed});
        if (found != made.end())
            return found->second;
        const PressBody body = press_body(c.body, c.seed);
        const Grid grid = make_grid(glm::uvec3(48), glm::dvec3(kSpacing_mm), glm::dvec3(-kHalf_mm));
        const auto value = [&](glm::uvec3 i) {
            const double d = body.distance(glm::dvec3(i) * kSpacing_mm - kHalf_mm);
            return is_labels ? (d < 0.0 ? 3.0 : 0.0)
                             : std::round(500.0 * std::erfc(d / (std::sqrt(2.0) * 0.35)));
        };
        return made
            .emplace(std::pair{c.body, c.seed},
                     make_volume(grid, is_labels ? ScalarType::u8 : ScalarType::i16, value))
            .first->second;
    }
    std::shared_ptr<const TouchMesh> mesh(const PressCase& c) {
        auto& mesh = meshes[{c.body, c.seed}];
        if (!mesh)
            mesh = make_touch_mesh(
                std::make_shared<const Mesh>(marching_cubes(volume(c, true), 0.5f)), 0.5);
        return mesh;
    }
};

inline Pressed press(const PressCase& c, PressScenes& scenes) {
    std::mt19937_64 random(1009 * c.seed + 10 * uint64_t(c.from) + c.body);
    const auto within = [&](double low, double high) {
        return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    const PressBody body = press_body(c.body, c.seed);
    Pressed pressed;
    pressed.t0_n = within(0.5, 2.5);
    TouchParameters q{.iso = 500.0,
                      .tool_radius_mm = c.radius_mm,
                      .stiffness_n_per_m = within(800.0, 2000.0),
                      .source = TouchSource::labels};
    const double other_n = within(0.3, 0.9) * pressed.t0_n;
    LabelTouch own{.label = 3, .stiffness_n_per_m = q.stiffness_n_per_m};
    own.yield_n = pressed.t0_n;
    switch (c.from) {
        case T0From::parameters_grey:
            q.source = TouchSource::grey;
            [[fallthrough]];
        case T0From::parameters:
            q.yield_n = pressed.t0_n;
            break;
        case T0From::label_softer:
            q.yield_n = 4.0 * pressed.t0_n;
            [[fallthrough]];
        case T0From::label:
            q.labels[q.label_count++] = own;
            break;
        case T0From::label_harder:
            q.yield_n = other_n;
            q.labels[q.label_count++] = own;
            break;
        case T0From::unlisted:
            q.yield_n = pressed.t0_n;
            own.label = 7;
            own.yield_n = other_n;
            q.labels[q.label_count++] = own;
            break;
    }
    TouchScene scene{.version = 1};
    const bool is_grey = q.source == TouchSource::grey;
    (is_grey ? scene.grey : scene.labels) = scenes.volume(c, !is_grey);
    if (std::string_view(c.algorithm) == "swept-mesh")
        scene.touch_mesh = scenes.mesh(c);

    // Along the body's own way out where it has one at the origin, and somewhat askew: in, aside,
    // back.
    const auto way_out = [&](glm::dvec3 at) {
        constexpr double kStep_mm = 1e-3;
        glm::dvec3 out(0.0);
        for (int axis = 0; axis < 3; ++axis) {
            glm::dvec3 step(0.0);
            step[axis] = kStep_mm;
            out[axis] = (body.distance(at + step) - body.distance(at - step)) / (2.0 * kStep_mm);
        }
        return out;
    };
    const glm::dvec3 askew(within(-0.2, 0.2), within(-0.2, 0.2), within(-0.2, 0.2));
    const glm::dvec3 beside = 8.0 * glm::normalize(glm::dvec3(within(-1, 1), within(-1, 1), 1.3));
    glm::dvec3 out = way_out(glm::dvec3(0.0));
    if (glm::length(out) < 0.1)
        out = way_out(beside);
    out = glm::normalize(out) + askew;
    const double start_mm = body.reach_mm + c.radius_mm + 2.5;
    const double end_mm = body.reach_mm - c.radius_mm - 4.0;
    const glm::dvec3 aside = 2.0 * glm::normalize(glm::cross(out, glm::dvec3(0.3, 1.0, 0.2)));
    const double speed = std::exp(within(std::log(30.0), std::log(400.0)));
    const double way_s = (start_mm - end_mm) / speed;
    const std::unique_ptr<Algorithm> algorithm = find_algorithm(c.algorithm)->make();
    glm::dvec3 last = start_mm * out;
    for (double t = 0.0; t < 2.0 * way_s + 0.15; t += 1.0 / c.hertz) {
        const double in = std::min(t / way_s, 1.0),
                     back = std::clamp((t - way_s - 0.1) / way_s, 0.0, 1.0);
        const glm::dvec3 x = glm::mix(start_mm, end_mm, in - back) * out +
                             std::clamp((t - way_s) / 0.1, 0.0, 1.0) * aside;
        const TickInput input{.tool = {.position_mm = x},
                              .velocity_mm_per_s = c.hertz * (x - last),
                              .dt_s = 1.0 / c.hertz,
                              .scene = &scene,
                              .parameters = &q};
        if (t == 0.0)
            algorithm->reset(input);
        const TickOutput output = algorithm->tick(input);
        const double force = glm::length(output.force_n);
        pressed.is_finite = pressed.is_finite && std::isfinite(force);
        pressed.most_n = std::max(pressed.most_n, force);
        pressed.asked_n = std::max(
            pressed.asked_n, 1e-3 * q.stiffness_n_per_m * (c.radius_mm - body.distance(x) - 1.0));
        last = x;
    }
    return pressed;
}

} // namespace palpate::haptics
