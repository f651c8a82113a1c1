// palpate_ray_costs: measures what engine/accuracy/ray_costs.inc holds.
//
// Each scene is drawn with each setting, at 40 x 40 pixels; a setting's time is taken beside `fast`
// at one sample a voxel, drawn in turn. Its error beside grid truth is printed.

#include <CLI/CLI.hpp>

#include "engine/accuracy/accuracy.h"
#include "engine/base/file.h"
#include "engine/base/log.h"
#include "engine/gpu/device.h"
#include "engine/image/compare.h"
#include "engine/reference/truth.h"
#include "engine/render/renderer.h"
#include "engine/volume/synthetic.h"

namespace palpate {
namespace {

using namespace synthetic;

struct Training {
    std::string name;
    SceneData data;
    std::vector<std::pair<double, double>> ranges; // of values, for windows and peaks
};

SceneData on_cube(const Field& field, double half_mm, uint32_t side, ScalarType type,
                  double noise_sigma = 0.0) {
    const Grid grid =
        make_grid(glm::uvec3(side), glm::dvec3(2.0 * half_mm / (side - 1)), glm::dvec3(-half_mm));
    return {sample(field, grid, type, noise_sigma), std::nullopt};
}

std::vector<Training> training() {
    std::vector<Training> list;
    list.push_back(
        {"phantom", on_cube(ct_phantom(), 100.0, 72, ScalarType::i16, 12.0), {{-1024.0, 1200.0}}});
    list.push_back(
        {"marschner-lobb", on_cube(marschner_lobb(1.0), 1.0, 48, ScalarType::f32), {{0.0, 1.0}}});
    list.push_back({"gyroid", on_cube(gyroid(30.0), 50.0, 64, ScalarType::f32), {{-1.5, 1.5}}});
    list.push_back({"shells", on_cube(shells({}, 14.0), 50.0, 64, ScalarType::f32), {{0.0, 1.0}}});
    list.push_back({"gaussian",
                    on_cube(gaussian({3.0, -2.0, 1.0}, 15.0), 50.0, 48, ScalarType::i16),
                    {{0.0, 1000.0}}});
    return list;
}

// A window, triangular peaks of several widths at two places, and a step. Opacities are per
// fiftieth of the volume's side: neither veil nor wall. And a wall: nearly opaque within a voxel.
std::vector<TransferFunction> functions(double low, double high, double unit_mm) {
    const double width = high - low;
    std::vector<TransferFunction> list;
    const std::vector<TransferFunction::ColorPoint> colors{{low, {0.1, 0.3, 1.0}},
                                                           {high, {1.0, 0.7, 0.2}}};
    list.push_back({colors, {{low, 0.0}, {high, 0.15}}, unit_mm});
    for (const double part : {0.4, 0.1, 0.02})
        for (const double at : {0.35, 0.6}) {
            const double middle = low + at * width, foot = 0.5 * part * width;
            list.push_back({colors,
                            {{low, 0.0},
                             {middle - foot, 0.0},
                             {middle, 0.8},
                             {middle + foot, 0.0},
                             {high, 0.0}},
                            unit_mm});
        }
    list.push_back({colors,
                    {{low, 0.0}, {low + 0.55 * width, 0.0}, {low + 0.55 * width, 0.5}, {high, 0.5}},
                    unit_mm});
    list.push_back({colors, {{low, 0.0}, {high, 0.99}}, 0.3 * unit_mm});
    return list;
}

std::vector<RaySetting> settings() {
    std::vector<RaySetting> list;
    for (const double step : {2.0, 1.0, 0.5, 0.25, 0.125})
        list.push_back({Integrator::fast, step, 0});
    for (const double step : {1.0, 0.5, 0.25})
        list.push_back({Integrator::preintegrated, step, 0});
    // Not kMaxSubSteps, which choose_setting() tries last whatever they take.
    for (const uint32_t sub_steps : {1u, 2u, 4u, 8u, 16u, 32u})
        list.push_back({Integrator::exact, 0.0, sub_steps});
    return list;
}

constexpr RaySetting kUnit{Integrator::fast, 1.0, 0};

double gpu_ms(const FrameStats& stats) {
    double sum = 0.0;
    for (const PassTime& pass : stats.passes)
        sum += pass.gpu_ms;
    return sum;
}

struct Measured {
    std::vector<RayCost> rows;

    // Adds the times of all settings in one scene.
    Result<void> add(Renderer& renderer, Scene scene, const SceneData& data,
                     const std::string& name) {
        scene.ray_cast->min_transmittance = 0.0;
        const size_t kind = static_cast<size_t>(kind_of(*scene.ray_cast));
        const Image truth = render_truth(scene, data);
        std::string text;
        double unit_ms = 0.0;
        for (RayCost& row : rows) {
            apply(row.setting, data.volume.grid(), *scene.ray_cast);
            double ms = 1e30, error = 0.0;
            for (int turn = 0; turn < 3; ++turn) {
                PALPATE_TRY(const Frame frame, renderer.render(scene, data));
                ms = std::min(ms, gpu_ms(frame.stats));
                error = color_rmse(frame.eyes[0], truth);
            }
            if (row.setting == kUnit)
                unit_ms = ms;
            row.cost[kind] += ms;
            text += fmt::format(" {:.1e}", error);
        }
        log::info("{}: {:.1f} ms,{}", name, unit_ms, text);
        return {};
    }
};

Result<void> measure(Measured& out) {
    GpuDevice device(DeviceOptions{});
    log::info("on {}, {}", device.info().name, device.info().driver);
    Renderer renderer(device);
    for (const RaySetting& setting : settings())
        out.rows.push_back({setting, {}});
    for (const Training& volume : training()) {
        const Grid& grid = volume.data.volume.grid();
        Scene scene;
        scene.size_px = {40, 40};
        scene.camera = frame_volume(grid, {0.5, -1.0, 0.35}, {0, 0, 1}, 0.7);
        for (const auto& [low, high] : volume.ranges) {
            const double unit_mm = spacing_mm(grid).x * (grid.size.x - 1.0) / 50.0;
            for (const TransferFunction& function : functions(low, high, unit_mm))
                for (const SceneKind kind :
                     {SceneKind::alpha, SceneKind::shaded_alpha, SceneKind::mip}) {
                    scene.ray_cast = RayCastLayer{};
                    scene.ray_cast->transfer = function;
                    if (kind == SceneKind::shaded_alpha)
                        scene.ray_cast->shading = Shading{};
                    if (kind == SceneKind::mip)
                        scene.ray_cast->mode = RayMode::mip;
                    PALPATE_TRY(out.add(renderer, scene, volume.data, volume.name));
                }
            for (const double at : {0.3, 0.5, 0.7}) {
                scene.ray_cast = RayCastLayer{};
                scene.ray_cast->mode = RayMode::iso;
                scene.ray_cast->isos = {{low + at * (high - low)}};
                PALPATE_TRY(out.add(renderer, scene, volume.data, volume.name));
            }
        }
    }
    const auto unit = std::find_if(out.rows.begin(), out.rows.end(),
                                   [](const RayCost& row) { return row.setting == kUnit; });
    const std::array<double, 4> unit_ms = unit->cost;
    for (RayCost& row : out.rows)
        for (size_t kind = 0; kind < 4; ++kind)
            row.cost[kind] /= unit_ms[kind];
    return {};
}

std::string written(const Measured& measured, const std::string& device) {
    std::string text =
        "// Written by palpate_ray_costs; not to be edited. GPU time beside `fast` at one sample a "
        "voxel.\n// Kinds: alpha, shaded alpha, MIP, iso.\n// Measured on " +
        device + ".\n// clang-format off\n";
    constexpr const char* names[] = {"fast", "preintegrated", "exact"};
    for (const auto& [setting, cost] : measured.rows)
        text += fmt::format("{{{{Integrator::{}, {}, {}}}, {{{:.3g}, {:.3g}, {:.3g}, {:.3g}}}}},\n",
                            names[static_cast<int>(setting.integrator)], setting.step_voxels,
                            setting.sub_steps, cost[0], cost[1], cost[2], cost[3]);
    return text + "// clang-format on\n";
}

} // namespace
} // namespace palpate

int main(int argc, char** argv) {
    CLI::App app("Measures the time of all ways to integrate a ray.");
    std::string output;
    app.add_option("-o,--output", output, "engine/accuracy/ray_costs.inc")->required();
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    }
    try {
        palpate::Measured measured;
        const palpate::Result<void> done = palpate::measure(measured);
        if (!done) {
            palpate::log::error("{}", done.error().message);
            return 1;
        }
        palpate::GpuDevice device(palpate::DeviceOptions{});
        const std::string text =
            palpate::written(measured, device.info().name + ", " + device.info().driver);
        if (auto saved = palpate::save_bytes(output, std::as_bytes(std::span(text))); !saved) {
            palpate::log::error("{}", saved.error().message);
            return 1;
        }
    } catch (const std::exception& error) {
        palpate::log::error("{}", error.what());
        return 1;
    }
    return 0;
}
