#include "bench/suite/subject.h"

#include <algorithm>
#include <cmath>

#include "engine/base/assert.h"
#include "engine/io/volume_io.h"
#include "engine/scene/scene_names.h"
#include "engine/volume/builder.h"
#include "engine/volume/extent.h"
#include "engine/volume/sample.h"
#include "engine/volume/synthetic.h"

namespace palpate::bench {

namespace {

// The same samples with axes and origin of the world's.
Volume straightened(const Volume& volume) {
    return with_grid(volume, make_grid(volume.size(), spacing_mm(volume.grid())));
}

// A grid of `side` samples an axis that covers +-half_mm about the field's origin.
Grid centred_grid(uint32_t side, double half_mm, glm::dvec3 spacing) {
    const glm::dvec3 step = 2.0 * half_mm / (side - 1.0) * spacing;
    return make_grid(glm::uvec3(side), step, -0.5 * (side - 1.0) * step);
}

std::optional<Integrator> integrator_of(const std::string& name) {
    for (const auto& [known, value] : Names<Integrator>::list)
        if (name == known)
            return value;
    return std::nullopt;
}

Subject subject_of(const Sample& sample, RayMode mode, Metric metric) {
    Subject subject{.sample = &sample, .camera = peer_camera(sample.volume), .metric = metric};
    subject.layer.mode = mode;
    return subject;
}

} // namespace

Result<Sample> head_ct(const fs::path& path) {
    PALPATE_TRY(const LoadedVolume loaded, load_volume(path));
    const glm::uvec3 size = loaded.volume.size();
    return Sample{"head_ct", fmt::format("Head CT, {} x {} x {}", size.x, size.y, size.z),
                  straightened(loaded.volume)};
}

Sample resampled(const Sample& sample, glm::uvec3 size, std::string name) {
    const glm::dvec3 ratio = (glm::dvec3(sample.volume.size()) - 1.0) / (glm::dvec3(size) - 1.0);
    const Grid grid = make_grid(size, spacing_mm(sample.volume.grid()) * ratio);
    return {std::move(name),
            fmt::format("{}, resampled to {} x {} x {}", sample.title, size.x, size.y, size.z),
            make_volume(grid, ScalarType::i16, [&](glm::uvec3 index) {
                return trilinear(sample.volume, glm::dvec3(index) * ratio);
            })};
}

Sample phantom(uint32_t side, glm::dvec3 spacing) {
    return {"phantom", fmt::format("CT phantom, {0} x {0} x {0}", side),
            straightened(synthetic::sample_ct_phantom(centred_grid(side, 100.0, spacing)))};
}

Sample marschner_lobb(uint32_t side) {
    return {
        "marschner_lobb", fmt::format("Marschner-Lobb, {0} x {0} x {0}", side),
        straightened(synthetic::sample(synthetic::marschner_lobb(1.0),
                                       centred_grid(side, 1.0, glm::dvec3(1.0)), ScalarType::f32))};
}

Sample ball(uint32_t side) {
    return {"ball", fmt::format("Ball, {0} x {0} x {0}", side),
            straightened(synthetic::sample(synthetic::sphere(glm::dvec3(0.0), 30.0, 3.0),
                                           centred_grid(side, 50.0, glm::dvec3(1.0)),
                                           ScalarType::i16))};
}

Camera peer_camera(const Volume& volume) {
    const double elevation = 30.0 * std::acos(-1.0) / 180.0;
    return frame_volume(volume.grid(), {0.0, std::cos(elevation), std::sin(elevation)},
                        {0.0, 0.0, 1.0}, 0.8, 30.0);
}

Subject alpha_subject(const Sample& sample, const TransferFunction& transfer, std::string suffix) {
    Subject subject = subject_of(sample, RayMode::alpha, Metric::color);
    subject.name = sample.name + "/alpha" + (suffix.empty() ? "" : "-" + suffix);
    subject.title = sample.title + ": alpha" + (suffix.empty() ? "" : ", " + suffix);
    subject.layer.transfer = transfer;
    subject.peers = "alpha";
    return subject;
}

Subject shaded_subject(const Sample& sample, const TransferFunction& transfer) {
    Subject subject = alpha_subject(sample, transfer, "shaded");
    subject.layer.shading = Shading{};
    subject.peers = "alpha_shaded";
    return subject;
}

Subject mip_subject(const Sample& sample, double low, double high) {
    Subject subject = subject_of(sample, RayMode::mip, Metric::value);
    subject.name = sample.name + "/mip";
    subject.title = sample.title + ": MIP";
    subject.layer.transfer = window_function(low, high, 1.0);
    subject.peers = "mip";
    return subject;
}

Subject iso_subject(const Sample& sample, double value) {
    Subject subject = subject_of(sample, RayMode::iso, Metric::surface);
    subject.name = sample.name + "/iso";
    subject.title = fmt::format("{}: iso-surface at {}", sample.title, value);
    subject.layer.isos = {{value}};
    subject.peers = "iso";
    return subject;
}

TransferFunction peak(double center, double width, double height, double unit_mm) {
    const double half = 0.5 * width;
    TransferFunction transfer;
    transfer.colors = {{center - half, {0.9, 0.5, 0.2}}, {center + half, {0.3, 0.7, 1.0}}};
    transfer.opacities = {{center - half, 0.0}, {center, height}, {center + half, 0.0}};
    transfer.opacity_unit_mm = unit_mm;
    return transfer;
}

Scene scene_of(const Subject& subject, uint32_t size_px) {
    Scene scene;
    scene.size_px = glm::uvec2(size_px);
    scene.camera = subject.camera;
    scene.ray_cast = subject.layer;
    return scene;
}

std::string Setting::name() const {
    if (integrator == "exact")
        return sub_steps > 0 ? fmt::format("exact, {} sub-steps", sub_steps) : "exact";
    return fmt::format("{}, step {:g}", integrator, step_samples);
}

void apply(const Setting& setting, const Volume& volume, RayCastLayer& layer) {
    const auto integrator = integrator_of(setting.integrator);
    PALPATE_ASSERT(integrator.has_value());
    layer.integrator = *integrator;
    layer.step_mm = setting.step_samples * smallest_spacing_mm(volume.grid());
    if (setting.sub_steps > 0)
        layer.sub_steps = setting.sub_steps;
}

Setting default_setting() {
    for (const auto& [name, value] : Names<Integrator>::list)
        if (value == RayCastLayer{}.integrator)
            return {.integrator = name, .step_samples = 1.0};
    PALPATE_ASSERT(false);
    return {};
}

std::vector<Setting> settings_of(RayMode mode, bool full) {
    std::vector<double> steps{2.0, 1.0, 0.5, 0.25};
    if (full) {
        steps.insert(steps.begin(), 4.0);
        steps.push_back(0.125);
    }
    // The error of a MIP falls slowly with its step: at 1.25 it takes four fifths of the time of 1
    // and errs by a quarter more. VTK's points lie in between.
    if (mode == RayMode::mip)
        steps.insert(std::find(steps.begin(), steps.end(), 1.0), {1.25, 1.1});
    std::vector<Setting> settings;
    for (const double step : steps)
        settings.push_back({.integrator = "fast", .step_samples = step});
    if (mode == RayMode::alpha) // elsewhere it is the same as fast
        for (const double step : steps)
            settings.push_back({.integrator = "preintegrated", .step_samples = step});
    if (mode == RayMode::alpha)
        for (const uint32_t count : {1u, 2u, 4u, 8u})
            settings.push_back({"exact", 1.0, count});
    else
        settings.push_back({"exact", 1.0, 0});
    return settings;
}

} // namespace palpate::bench
