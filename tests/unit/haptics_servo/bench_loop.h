#pragma once

#include <cmath>
#include <memory>

#include "engine/volume/synthetic.h"
#include "haptics/core/clock.h"
#include "haptics/device/recorded.h"
#include "haptics/device/simulated.h"
#include "haptics/proxy/algorithms.h"
#include "haptics/servo/servo.h"

// A servo with everything it needs, on a virtual clock, for tests.
namespace palpate::haptics {

// Force from a wall: solid is z < wall_mm, which a scene may move through its version (for tests of
// the line about the algorithm, not of algorithms).
struct WallState {
    uint32_t ticks = 0;
};
inline TickOutput wall_tick(WallState& state, const TickInput& input) noexcept {
    ++state.ticks;
    TickOutput out{.proxy = input.tool};
    const double wall_mm = static_cast<double>(input.scene->version) / 1000.0;
    out.depth_mm = std::max(0.0, wall_mm - input.tool.position_mm.z);
    out.proxy.position_mm.z += out.depth_mm;
    out.force_n.z = input.parameters->stiffness_n_per_m * out.depth_mm / 1000.0;
    out.normal = {0, 0, 1};
    out.contact = out.depth_mm > 0 ? Contact::touching : Contact::free;
    return out;
}
using WallAlgorithm = StatefulAlgorithm<WallState, wall_tick>;

constexpr int64_t kTick_ns = 1'000'000;

struct Loop {
    Mailbox<TouchScene> scenes;
    Mailbox<TouchParameters> parameters;
    Ring<ToolStamp> poses{4096};
    std::atomic<float> removal{0.0f};
    Workspace workspace;
    std::unique_ptr<Algorithm> algorithm;
    std::unique_ptr<HapticDevice> device;
    Servo servo;
    int64_t now_ns = 0;

    static std::unique_ptr<HapticDevice> simulated(const HandPath& path, const char* preset) {
        return std::make_unique<SimulatedDevice>(*find_device_preset(preset), HandModel{}, path,
                                                 Workspace({0, 0, 0}, 1.0));
    }
    Loop(TouchScene scene, TouchParameters p, std::unique_ptr<Algorithm> a,
         std::unique_ptr<HapticDevice> d, Servo::Options options = {},
         const Workspace& w = Workspace({0, 0, 0}, 1.0))
        : scenes(std::make_unique<const TouchScene>(std::move(scene))),
          parameters(std::make_unique<const TouchParameters>(p)),
          workspace(w),
          algorithm(std::move(a)),
          device(std::move(d)),
          servo({*device, *algorithm, scenes, parameters, &poses, nullptr, &removal}, workspace,
                options) {
        servo.arm();
    }
    ServoTick tick(int64_t late_ns = 0) {
        const int64_t due_ns = now_ns += kTick_ns;
        now_ns += late_ns;
        return servo.tick(now_ns, due_ns);
    }
};

inline TouchScene ball_scene(uint32_t samples = 64) {
    const Grid grid = make_grid(glm::uvec3(samples), glm::dvec3(40.0 / samples),
                                glm::dvec3(-20.0 + 20.0 / samples));
    return {
        .grey = synthetic::sample(synthetic::sphere({0, 0, 0}, 10.0, 0.5), grid, ScalarType::i16),
        .version = 1};
}

} // namespace palpate::haptics
