// palpate_accuracy_table: measures what engine/scene/accuracy_table.inc holds.
//
// Each training scene is drawn by the renderer with each setting, at 40 x 40 pixels, and compared
// with grid truth; a setting's time is taken beside `fast` at one sample a voxel, drawn in turn.

#include <CLI/CLI.hpp>
#include <cmath>

#include "engine/base/file.h"
#include "engine/base/log.h"
#include "engine/gpu/device.h"
#include "engine/image/compare.h"
#include "engine/reference/truth.h"
#include "engine/render/renderer.h"
#include "engine/scene/accuracy.h"
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
// fiftieth of the volume's side: neither veil nor wall.
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
    return list;
}

std::vector<RaySetting> settings() {
    std::vector<RaySetting> list;
    for (const double step : {2.0, 1.0, 0.5, 0.25, 0.125})
        list.push_back({Integrator::fast, step, 0});
    for (const double step : {1.0, 0.5, 0.25})
        list.push_back({Integrator::preintegrated, step, 0});
    for (const uint32_t sub_steps : {1u, 2u, 4u, 8u, 16u, 32u})
        list.push_back({Integrator::exact, 0.0, sub_steps});
    return list;
}

double gpu_ms(const FrameStats& stats) {
    double sum = 0.0;
    for (const PassTime& pass : stats.passes)
        sum += pass.gpu_ms;
    return sum;
}

struct Measured {
    std::vector<MeasuredSetting> rows;
    std::vector<std::array<double, 4>> time_sums;
    std::array<std::array<int, kSharpnessClasses>, 4> scenes{};

    // Time and error of all settings in one scene.
    Result<void> add(Renderer& renderer, Scene scene, const SceneData& data, size_t c,
                     const std::string& name) {
        scene.ray_cast->min_transmittance = 0.0;
        const size_t kind = static_cast<size_t>(kind_of(*scene.ray_cast));
        ++scenes[kind][c];
        const Image truth = render_truth(scene, data);
        std::string text;
        double unit_ms = 0.0;
        for (size_t i = 0; i < rows.size(); ++i) {
            apply(rows[i].setting, data.volume.grid(), *scene.ray_cast);
            double ms = 1e30, error = 0.0;
            for (int turn = 0; turn < 3; ++turn) {
                const Result<Frame> frame = renderer.render(scene, data);
                if (!frame)
                    return tl::unexpected(frame.error());
                ms = std::min(ms, gpu_ms(frame->stats));
                error = color_rmse(frame->eyes[0], truth);
            }
            if (rows[i].setting == RaySetting{Integrator::fast, 1.0, 0})
                unit_ms = ms;
            rows[i].rmse[kind][c] = std::max(rows[i].rmse[kind][c], error);
            time_sums[i][kind] += ms;
            text += fmt::format(" {:.1e}", error);
        }
        log::info("{} class {}: {:.1f} ms,{}", name, c, unit_ms, text);
        return {};
    }
};

Result<void> measure(Measured& out) {
    Device device({});
    log::info("on {}, {}", device.info().name, device.info().driver);
    Renderer renderer(device);
    for (const RaySetting& setting : settings())
        out.rows.push_back({setting, {}, {}});
    out.time_sums.resize(out.rows.size(), {});
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
                    const size_t c = sharpness_class(sharpness_of(function, volume.data.volume));
                    if (auto done = out.add(renderer, scene, volume.data, c, volume.name); !done)
                        return done;
                }
            for (const double at : {0.3, 0.5, 0.7}) {
                scene.ray_cast = RayCastLayer{};
                scene.ray_cast->mode = RayMode::iso;
                scene.ray_cast->isos = {{low + at * (high - low)}};
                if (auto done = out.add(renderer, scene, volume.data, 0, volume.name); !done)
                    return done;
            }
        }
    }
    const auto unit = std::find_if(out.rows.begin(), out.rows.end(), [](const auto& row) {
        return row.setting == RaySetting{Integrator::fast, 1.0, 0};
    });
    const auto unit_times = out.time_sums[static_cast<size_t>(unit - out.rows.begin())];
    for (size_t i = 0; i < out.rows.size(); ++i)
        for (size_t kind = 0; kind < 4; ++kind) {
            MeasuredSetting& row = out.rows[i];
            row.cost[kind] = out.time_sums[i][kind] / unit_times[kind];
            // Classes that no scene fell into take the error of the next sharper one that has any;
            // and no class errs less than a less sharp one.
            for (size_t c = kSharpnessClasses - 1; c-- > 0;)
                if (out.scenes[kind][c] == 0)
                    row.rmse[kind][c] = row.rmse[kind][c + 1];
            for (size_t c = 1; c < kSharpnessClasses; ++c)
                row.rmse[kind][c] = std::max(row.rmse[kind][c], row.rmse[kind][c - 1]);
        }
    return {};
}

std::string written(const Measured& measured, const std::string& device) {
    std::string text =
        "// Written by palpate_accuracy_table; not to be edited. RMSE of colour against grid "
        "truth,\n"
        "// the largest over training scenes of a kind up to a class of sharpness, and time "
        "beside\n"
        "// `fast` at one sample a voxel. Kinds: alpha, shaded alpha, MIP, iso.\n// Measured on " +
        device + ".\n// clang-format off\n";
    constexpr const char* names[] = {"fast", "preintegrated", "exact"};
    for (const MeasuredSetting& row : measured.rows) {
        text +=
            fmt::format("{{{{Integrator::{}, {}, {}}}, {{{:.3g}, {:.3g}, {:.3g}, {:.3g}}}, {{\n",
                        names[static_cast<int>(row.setting.integrator)], row.setting.step_voxels,
                        row.setting.sub_steps, row.cost[0], row.cost[1], row.cost[2], row.cost[3]);
        for (const auto& kind : row.rmse) {
            text += "    {";
            for (size_t c = 0; c < kSharpnessClasses; ++c)
                text += fmt::format("{}{:.2e}", c ? ", " : "", kind[c]);
            text += "},\n";
        }
        text += "}},\n";
    }
    return text + "// clang-format on\n";
}

} // namespace
} // namespace palpate

int main(int argc, char** argv) {
    CLI::App app("Measures error and time of all ways to integrate a ray on training scenes.");
    std::string output;
    app.add_option("-o,--output", output, "engine/scene/accuracy_table.inc")->required();
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
        palpate::Device device({});
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
