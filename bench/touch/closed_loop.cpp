#include "bench/touch/closed_loop.h"

#include <algorithm>
#include <cmath>

#include "bench/touch/open_loop.h"
#include "engine/base/assert.h"
#include "haptics/proxy/algorithms.h"
#include "haptics/safety/chain.h"

namespace palpate::touch {

using glm::dvec3;

namespace {

class Simulated final : public HeldDevice {
 public:
    Simulated(const Loop& loop, const haptics::HandPath& path, const haptics::Workspace& workspace)
        : device_(*loop.device, loop.hand, path, workspace) {}
    void wait(int64_t) override {}
    haptics::HapticDevice& device() override { return device_; }
    const haptics::SimulatedDevice& plant() const override { return device_; }

 private:
    haptics::SimulatedDevice device_;
};

} // namespace

LoopResult closed_loop(haptics::Algorithm& algorithm, const Scene& scene, const Path& path,
                       const haptics::TouchParameters& parameters, const Loop& loop) {
    std::vector<haptics::HandPose> poses;
    for (size_t i = 0; i < path.size(); ++i)
        poses.push_back({.time_s = kTick_s * static_cast<double>(i), .tool = {path[i]}});
    const haptics::HandPath intended(std::move(poses));
    haptics::Workspace workspace(dvec3(0.0), 1.0);
    const std::unique_ptr<HeldDevice> held =
        loop.make_held ? loop.make_held(intended, loop.hand)
                       : std::make_unique<Simulated>(loop, intended, workspace);
    haptics::HapticDevice& device = held->device();
    const haptics::SimulatedDevice& plant = held->plant();

    const haptics::SafetyLimits limits;
    const double most_n = most_force_n(limits, device.capabilities());
    haptics::Passivity passivity(passivity_settings(limits, device.capabilities()));
    double stored_j = 0.0;
    const auto controlled = [&](const haptics::DeviceSample& sample, dvec3 rendered_n) {
        // A force that is not a number becomes zero, as in the chain.
        const dvec3 force_n = haptics::limit_magnitude(rendered_n, 1e6);
        stored_j =
            haptics::stored_energy_j(glm::length(force_n), parameters.stiffness_n_per_m, most_n);
        const dvec3 damped_n =
            passivity.limit(sample.position_m, sample.velocity_m_per_s, force_n,
                            {stored_j, parameters.stiffness_n_per_m}, loop.tick_s);
        const dvec3 sent_n = haptics::limit_magnitude(damped_n, most_n);
        passivity.sent(sent_n);
        return sent_n;
    };

    LoopResult result;
    Judge judge(scene, parameters.stiffness_n_per_m, false, false, parameters.tool_radius_mm);
    Player player(scene);
    haptics::TickInput input{.dt_s = loop.tick_s, .scene = &scene.touch, .parameters = &parameters};
    input.tool.position_mm = path.front();
    algorithm.reset(input);
    const auto ticks = static_cast<size_t>(intended.end_s() / loop.tick_s);
    const auto tail = static_cast<size_t>(0.5 / loop.tick_s);
    dvec3 low(INFINITY), high(-INFINITY);
    haptics::DeviceSample sample;
    for (size_t i = 0; i < ticks; ++i) {
        const auto now = static_cast<int64_t>(std::llround(1e9 * loop.tick_s * double(i)));
        held->wait(now);
        device.read(now, sample); // where nothing new came, it stays
        player.next(judge, input);
        input.tool = workspace.tool(sample);
        input.velocity_mm_per_s = workspace.velocity_mm_per_s(sample);
        const haptics::TickOutput output = algorithm.tick(input);
        haptics::Wrench wrench = workspace.to_device({output.force_n, output.torque_nm});
        if (loop.is_controlled)
            wrench.force_n = controlled(sample, wrench.force_n);
        result.largest_sent_n = std::max(result.largest_sent_n, glm::length(wrench.force_n));
        device.write(now, wrench);
        judge.see(input.tool.position_mm, output);
        if (i + tail >= ticks) {
            low = glm::min(low, 1e3 * plant.true_position_m());
            high = glm::max(high, 1e3 * plant.true_position_m());
            result.settled_force_n += glm::length(output.force_n) / static_cast<double>(tail);
        }
    }
    result.figures = judge.figures();
    result.work_mj = 1e3 * plant.motor_work_j();
    result.held_mj = 1e3 * stored_j;
    const dvec3 swing = high - low;
    result.limit_cycle_mm = std::max({swing.x, swing.y, swing.z});
    return result;
}

std::vector<ZWidthCell> z_width(const char* name, const haptics::DevicePreset& device,
                                uint32_t columns, uint32_t rows) {
    TouchCase body{.id = "A1", .name = "plane"};
    body.solid = plane({0, 0, 0.13}, {0, 0, 1});
    body.touch_mm = {0, 0, 0.13};
    const Scene scene = make_scene(body, {});
    Path path = press(body, 40.0, 3.0, 1.2);
    path.resize(path.size() - 125); // up to the end of the hold
    const haptics::AlgorithmEntry* entry = haptics::find_algorithm(name);
    PALPATE_ASSERT(entry);
    const auto algorithm = entry->make();
    std::vector<ZWidthCell> cells;
    for (uint32_t row = 0; row < rows; ++row)
        for (uint32_t column = 0; column < columns; ++column) {
            ZWidthCell cell{.stiffness_n_per_m = 500.0 * std::exp2(0.5 * column),
                            .damping_n_s_per_m = 0.5 * row};
            haptics::TouchParameters parameters = scene_parameters(scene);
            parameters.stiffness_n_per_m = cell.stiffness_n_per_m;
            parameters.damping_n_s_per_m = cell.damping_n_s_per_m;
            parameters.normal_blur_samples = 0.0;
            // A soft hand: it damps least.
            const Loop loop{
                .device = &device,
                .hand = {.mass_kg = 0.05, .damping_n_s_per_m = 1.5, .stiffness_n_per_m = 150.0}};
            cell.limit_cycle_mm =
                closed_loop(*algorithm, scene, path, parameters, loop).limit_cycle_mm;
            cell.stable = cell.limit_cycle_mm <= 0.05;
            cells.push_back(cell);
        }
    return cells;
}

} // namespace palpate::touch
