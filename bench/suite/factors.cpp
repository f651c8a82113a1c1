#include "bench/suite/factors.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <random>

#include "engine/base/profile.h"
#include "engine/scene/presets.h"

namespace palpate::bench {

namespace {

struct Factor {
    const char* name;
    std::vector<std::string> levels; // the first is the default
};

std::vector<Factor> factors(bool tiny) {
    std::vector<Factor> all{
        {"mode", {"alpha", "mip", "iso"}},
        {"integrator", {"fast", "preintegrated", "exact"}},
        {"step", {"1", "2", "0.5", "0.25"}},
        {"volume format", {"as the device likes", "16 bits", "32 bits"}},
        {"samples an axis", {"96", "64", "128"}},
        {"spacing", {"1:1:1", "1:1:5"}},
        {"transfer function", {"smooth", "step", "2 % peak", "0.2 % peak", "bone", "vessels"}},
        {"shading", {"off", "on"}},
        {"ends below", {"1/1024", "1/64", "never"}},
        {"view", {"oblique", "along an axis", "inside", "grazing"}},
        {"eyes", {"one", "two"}},
    };
    if (tiny)
        all[4].levels = {"16", "12", "20"};
    return all;
}

// One level a factor, in their order.
using Choice = std::vector<size_t>;

TransferFunction transfer_named(const std::string& name) {
    if (name == "step")
        return {{{-200, {0.9, 0.6, 0.5}}, {300, {1, 0.95, 0.85}}}, {{200, 0.0}, {200, 0.6}}, 1.0};
    if (name == "2 % peak") // of the phantom's range of 2100 HU
        return peak(600.0, 42.0, 0.9, 1.0);
    if (name == "0.2 % peak")
        return peak(600.0, 4.2, 0.9, 1.0);
    if (name == "bone")
        return *preset("ct-bone");
    if (name == "vessels")
        return *preset("ct-vessels");
    return *preset("ct-peer");
}

Camera camera_named(const std::string& name, const Volume& volume) {
    Camera camera = peer_camera(volume);
    const Grid& grid = volume.grid();
    const glm::dvec3 middle = center_mm(grid);
    const glm::dvec3 size = spacing_mm(grid) * (glm::dvec3(grid.size) - 1.0);
    if (name == "along an axis")
        camera = frame_volume(grid, {0, 1, 0}, {0, 0, 1}, 0.8, 30.0);
    if (name == "inside") {
        camera.eye_mm = middle + glm::dvec3(0.03, 0.05, 0.02) * size;
        camera.target_mm = middle + glm::dvec3(0.1, 0.4, 0.1) * size;
        camera.view_angle_deg = 60.0;
    }
    if (name == "grazing") { // almost within the plane of the topmost samples
        camera.target_mm = middle + glm::dvec3(0.0, 0.0, 0.49) * size;
        camera.eye_mm = camera.target_mm + glm::dvec3(0.1, 2.0, 0.02) * size;
    }
    return camera;
}

struct Made {
    double ms = 0, error = 0;
};

class Experiment {
 public:
    explicit Experiment(Bench& bench) : bench_(bench), factors_(factors(bench.options().tiny)) {}

    const std::vector<Factor>& all() const { return factors_; }

    Result<Made> measure(const Choice& choice) {
        const auto level = [&](const char* name) -> const std::string& {
            for (size_t f = 0; f < factors_.size(); ++f)
                if (std::string_view(factors_[f].name) == name)
                    return factors_[f].levels[choice[f]];
            return factors_[0].levels[0];
        };
        const std::string key = level("samples an axis") + level("spacing");
        std::unique_ptr<Sample>& sample = samples_[key];
        if (!sample)
            sample = std::make_unique<Sample>(
                phantom(static_cast<uint32_t>(std::stoul(level("samples an axis"))),
                        level("spacing") == "1:1:5" ? glm::dvec3(1, 1, 5) : glm::dvec3(1.0)));
        const TransferFunction transfer = transfer_named(level("transfer function"));
        Subject subject = alpha_subject(*sample, transfer, "");
        if (level("mode") == "mip")
            subject = mip_subject(*sample, -200, 1200);
        if (level("mode") == "iso")
            subject = iso_subject(*sample, 600);
        subject.camera = camera_named(level("view"), sample->volume);
        subject.metric = Metric::color; // one unit for all modes
        if (level("mode") == "alpha" && level("shading") == "on")
            subject.layer.shading = Shading{};
        subject.layer.min_transmittance = level("ends below") == "never"  ? 0.0
                                          : level("ends below") == "1/64" ? 1.0 / 64.0
                                                                          : 1.0 / 1024.0;
        const uint32_t size_px = bench_.options().tiny ? 16 : 48;
        PALPATE_TRY(const Image truth, bench_.truth(subject, {size_px, 1}));
        Setting setting{.integrator = level("integrator"),
                        .step_samples = std::stod(level("step"))};
        if (setting.integrator == "exact" && level("mode") == "alpha")
            setting.sub_steps = 8;
        Renderer& renderer = renderer_of(level("volume format"));
        Scene scene = scene_of(subject, size_px);
        apply(setting, sample->volume, *scene.ray_cast);
        const SceneData data = subject.data();
        PALPATE_TRY(const Frame frame, renderer.render(scene, data));
        Made made;
        made.error = errors_of(frame.eyes[0], truth, Metric::color, 1.0).rmse;
        scene.size_px = glm::uvec2(bench_.options().tiny ? 32 : 192);
        if (level("eyes") == "two") {
            const double away = glm::length(scene.camera.target_mm - scene.camera.eye_mm);
            scene.stereo = StereoSettings{{away / 30.0, away}, StereoLayout::separate};
        }
        std::vector<double> times;
        for (int i = 0; i < 4; ++i) { // the first is not counted
            PALPATE_TRY(const FrameStats stats, renderer.draw(scene, data));
            if (i > 0)
                times.push_back(stats.wall_ms);
        }
        made.ms = *std::min_element(times.begin(), times.end());
        return made;
    }

    Json named(const Choice& choice) const {
        Json v = Json::object();
        for (size_t f = 0; f < factors_.size(); ++f)
            v[factors_[f].name] = factors_[f].levels[choice[f]];
        return v;
    }

 private:
    Renderer& renderer_of(const std::string& format) {
        std::unique_ptr<Renderer>& renderer = renderers_[format];
        if (!renderer) {
            RendererOptions options;
            if (format == "16 bits")
                options.volume_format = TexelFormat::unorm16;
            if (format == "32 bits")
                options.volume_format = TexelFormat::f32;
            renderer = std::make_unique<Renderer>(bench_.device(), options);
        }
        return *renderer;
    }

    Bench& bench_;
    std::vector<Factor> factors_;
    std::map<std::string, std::unique_ptr<Renderer>> renderers_; // pipelines are made once
    std::map<std::string, std::unique_ptr<Sample>> samples_;
};

// `count` choices in which each level of a factor comes equally often, or once more than another.
std::vector<Choice> latin_hypercube(const std::vector<Factor>& factors, uint32_t count) {
    std::mt19937_64 random(20261120); // the same experiment every time
    std::vector<Choice> choices(count, Choice(factors.size()));
    for (size_t f = 0; f < factors.size(); ++f) {
        std::vector<size_t> column(count);
        for (size_t i = 0; i < count; ++i)
            column[i] = i % factors[f].levels.size();
        for (size_t i = count; i-- > 1;) // Fisher and Yates
            std::swap(column[i], column[random() % (i + 1)]);
        for (size_t i = 0; i < count; ++i)
            choices[i][f] = column[i];
    }
    return choices;
}

// Errors below this are taken as this: what fp32 leaves, and so that 0 has a logarithm.
double log_error(double error) {
    return std::log(std::max(error, 1e-8));
}

} // namespace

Result<Json> factors_json(Bench& bench, uint32_t hypercube) {
    const profile::Scope scope("factors");
    Experiment experiment(bench);
    const std::vector<Factor>& all = experiment.all();
    const Choice usual(all.size(), 0);
    PALPATE_TRY(const Made base, experiment.measure(usual));
    Json v;
    v["default"] = {{"levels", experiment.named(usual)}, {"ms", base.ms}, {"rmse", base.error}};
    v["one_at_a_time"] = Json::array();
    for (size_t f = 0; f < all.size(); ++f)
        for (size_t level = 1; level < all[f].levels.size(); ++level) {
            if (bench.options().stop.stop_requested())
                return fail("interrupted at {} = {}", all[f].name, all[f].levels[level]);
            Choice choice = usual;
            choice[f] = level;
            const Result<Made> made = experiment.measure(choice);
            if (!made)
                return fail("{} = {}: {}", all[f].name, all[f].levels[level], made.error().message);
            v["one_at_a_time"].push_back({{"factor", all[f].name},
                                          {"level", all[f].levels[level]},
                                          {"ms", made->ms},
                                          {"rmse", made->error},
                                          {"time_ratio", made->ms / base.ms},
                                          {"error_ratio", made->error / base.error}});
        }
    const std::vector<Choice> choices = latin_hypercube(all, hypercube);
    std::vector<Made> found;
    v["hypercube"] = Json::array();
    double mean_time = 0, mean_error = 0;
    for (const Choice& choice : choices) {
        if (bench.late(0.95) && found.size() > 1)
            break;
        if (bench.options().stop.stop_requested())
            return fail("interrupted within the hypercube");
        PALPATE_TRY(const Made made, experiment.measure(choice));
        found.push_back(made);
        mean_time += std::log(made.ms);
        mean_error += log_error(made.error);
        v["hypercube"].push_back(
            {{"levels", experiment.named(choice)}, {"ms", made.ms}, {"rmse", made.error}});
    }
    const auto drawn = static_cast<double>(found.size());
    v["main_effects"] = Json::array();
    for (size_t f = 0; f < all.size(); ++f)
        for (size_t level = 0; level < all[f].levels.size(); ++level) {
            double time = 0, error = 0;
            uint32_t n = 0;
            for (size_t i = 0; i < found.size(); ++i)
                if (choices[i][f] == level) {
                    time += std::log(found[i].ms);
                    error += log_error(found[i].error);
                    ++n;
                }
            if (n > 0)
                v["main_effects"].push_back(
                    {{"factor", all[f].name},
                     {"level", all[f].levels[level]},
                     {"settings", n},
                     {"time_ratio", std::exp(time / n - mean_time / drawn)},
                     {"error_ratio", std::exp(error / n - mean_error / drawn)}});
        }
    return v;
}

} // namespace palpate::bench
