#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <span>

#include "apps/palpate/command.h"
#include "apps/palpate/device_options.h"
#include "apps/palpate/interrupt.h"
#include "apps/palpate/preview.h"
#include "apps/palpate/progress.h"
#include "apps/palpate/read_options.h"
#include "apps/palpate/scene_options.h"
#include "engine/base/file.h"
#include "engine/base/log.h"
#include "engine/base/profile.h"
#include "engine/base/timer.h"
#include "engine/image/exr.h"
#include "engine/image/png.h"
#include "engine/loading/scene_meshes.h"
#include "engine/render/interactive.h"
#include "engine/render/stereo_layout.h"
#include "engine/scene/accuracy.h"

namespace palpate {

namespace {

using Json = nlohmann::ordered_json;

struct RenderOptions {
    SceneOptions scene;
    ReadFlags read;
    DeviceMemoryOptions memory;
    std::string preview;
    std::string output, stats, device, format = "auto", write_scene;
    uint32_t frames = 1;
    double orbit_deg = 0.0, frame_ms = 0.0, error = 0.0;
    bool half = false, validate = false, no_skipping = false, settle = false;
};

double percentile(std::vector<double> values, double share) {
    std::sort(values.begin(), values.end());
    return values[static_cast<size_t>(std::ceil(share * static_cast<double>(values.size()))) - 1];
}

// What the frames of one run took.
struct Timing {
    double first_frame_ms = 0;           // pipelines, uploads and the first frame
    std::vector<double> wall_ms, gpu_ms; // of the frames after it; of the first if it is alone
    std::vector<PassTime> passes;        // medians
    double cell_map_ms = 0;              // of the first frame
    uint64_t samples = 0;                // of the last frame; none with --frame-ms
    FrameStats first;                    // of the first frame: uploads, residency
    std::optional<InteractiveFrame> interactive; // the last frame with --frame-ms

    // Median over the frames of how far the GPU's timestamps and the fenced wall clock are apart,
    // as a share of the latter. Clocks that lie, passes that nobody timed and waits between
    // submissions show here.
    double disagreement() const {
        std::vector<double> shares;
        for (size_t i = 0; i < wall_ms.size(); ++i)
            shares.push_back(std::abs(gpu_ms[i] - wall_ms[i]) / wall_ms[i]);
        return percentile(shares, 0.5);
    }
};
constexpr double kClocksMayDiffer = 0.1;

void say_clocks(const Timing& timing) {
    if (timing.disagreement() > kClocksMayDiffer)
        log::warning(
            "GPU timestamps give {:.3f} ms a frame and the fenced wall clock {:.3f} ms: they "
            "differ by {:.0f} %",
            percentile(timing.gpu_ms, 0.5), percentile(timing.wall_ms, 0.5),
            100.0 * timing.disagreement());
}

// Draws the scene once, for a moving hand where a budget is given.
Result<FrameStats> draw_once(Renderer& renderer, std::optional<Interactive>& interactive,
                             const Scene& scene, const SceneData& data, Timing& timing) {
    if (!interactive)
        return renderer.draw(scene, data);
    Result<InteractiveFrame> drawn = interactive->draw(scene, data);
    if (!drawn)
        return tl::unexpected(drawn.error());
    timing.interactive = *drawn;
    return drawn->frame;
}

Result<Timing> draw_frames(Renderer& renderer, Scene scene, const SceneData& data,
                           const RenderOptions& options, const Interrupt& interrupt) {
    Timing timing;
    std::map<std::string, std::vector<double>> passes;
    std::optional<Interactive> interactive;
    if (options.frame_ms > 0)
        interactive.emplace(renderer, options.frame_ms);
    // One frame more than asked for: the first pays for pipelines and uploads, and is told apart.
    const uint32_t count = options.frames > 1 ? options.frames + 1 : 1;
    for (uint32_t i = 0; i < count; ++i) {
        if (interrupt.token().stop_requested())
            return fail("interrupted after {} of {} frames", i, count);
        const Timer timer;
        const Result<FrameStats> stats = draw_once(renderer, interactive, scene, data, timing);
        if (!stats)
            return tl::unexpected(stats.error());
        if (i == 0) {
            timing.first_frame_ms = timer.ms();
            timing.cell_map_ms = stats->cell_map_ms;
            timing.first = *stats;
        }
        if (i > 0 || count == 1) {
            timing.wall_ms.push_back(stats->wall_ms);
            double gpu = 0;
            for (const PassTime& pass : stats->passes) {
                gpu += pass.gpu_ms;
                passes[pass.name].push_back(pass.gpu_ms);
            }
            timing.gpu_ms.push_back(gpu);
            timing.passes = stats->passes;
        }
        if (i + 1 < count)
            scene.camera = orbit(scene.camera, options.orbit_deg);
    }
    while (interactive && options.settle && !timing.interactive->complete) {
        if (interrupt.token().stop_requested())
            return fail("interrupted while the picture settled");
        if (const auto drawn = draw_once(renderer, interactive, scene, data, timing); !drawn)
            return tl::unexpected(drawn.error());
    }
    if (!options.stats.empty() && scene.ray_cast && !interactive) {
        // Once more with the variant that counts, which no timed frame pays for.
        const Result<uint64_t> samples = renderer.count_samples(scene, data);
        if (!samples)
            return tl::unexpected(samples.error());
        timing.samples = *samples;
    }
    for (PassTime& pass : timing.passes)
        pass.gpu_ms = percentile(passes[pass.name], 0.5);
    return timing;
}

// CPU devices interpolate in fp32, others with weights of a few bits.
double weight_error(const Device& device) {
    return device.info().is_cpu()
               ? 0.0
               : std::ldexp(1.0, -static_cast<int>(device.limits().subTexelPrecisionBits) - 1);
}

// --error: the fastest setting for which pictures of this kind err less.
Result<void> meet_error(const RenderOptions& options, const Device& device, const SceneData& data,
                        Scene& scene) {
    if (options.error <= 0.0)
        return {};
    if (!scene.ray_cast)
        return fail("--error: expected a scene with ray casting, found slices alone");
    const Result<AccuracyChoice> choice =
        choose_setting(scene, data, options.error, weight_error(device));
    if (!choice)
        return fail("{}", choice.error().message);
    apply(choice->setting, data.volume.grid(), *scene.ray_cast);
    scene.ray_cast->min_transmittance = choice->min_transmittance;
    log::info("{}: an RMSE of colour of {:.1e} is expected, {:g} was asked for",
              text_of(choice->setting), choice->error_estimate, options.error);
    return {};
}

Json stats_json(const Device& device, const Renderer& renderer, const Timing& timing,
                const Scene& scene, const SceneData& data) {
    Json json;
    json["device"] = device.info().name;
    json["driver"] = device.info().driver;
    json["first_frame_ms"] = timing.first_frame_ms;
    json["pipeline_creation_ms"] = renderer.pipeline_creation_ms();
    json["frame_ms"] = {{"median", percentile(timing.wall_ms, 0.5)},
                        {"p95", percentile(timing.wall_ms, 0.95)},
                        {"gpu_median", percentile(timing.gpu_ms, 0.5)},
                        {"frames", timing.wall_ms.size()}};
    json["clocks"] = {{"gpu_ms", percentile(timing.gpu_ms, 0.5)},
                      {"fenced_wall_ms", percentile(timing.wall_ms, 0.5)},
                      {"disagreement", timing.disagreement()},
                      {"agree", timing.disagreement() <= kClocksMayDiffer}};
    const Device::Traffic& traffic = device.traffic();
    json["bytes_moved"] = {{"to_device", traffic.uploaded_bytes},
                           {"uploads", traffic.uploads},
                           {"from_device", traffic.read_back_bytes},
                           {"read_backs", traffic.read_backs}};
    json["passes"] = Json::array();
    for (const PassTime& pass : timing.passes)
        json["passes"].push_back({{"name", pass.name}, {"gpu_ms", pass.gpu_ms}});
    json["resources"] = Json::array();
    for (const ResourceInfo& resource : device.resources())
        json["resources"].push_back(
            {{"name", resource.name}, {"kind", resource.kind}, {"bytes", resource.bytes}});
    if (scene.ray_cast && timing.interactive) {
        json["interactive"] = {{"step_factor", timing.interactive->step_factor},
                               {"traced_share", timing.interactive->traced_share},
                               {"error_estimate", timing.interactive->error_estimate},
                               {"complete", timing.interactive->complete}};
    } else if (scene.ray_cast) {
        json["samples"] = timing.samples;
        // `exact` takes pieces of cells, of which no lattice tells how many there would be.
        const bool lattice = scene.ray_cast->integrator != Integrator::exact;
        const uint64_t segments = lattice ? count_segments(scene, data.volume.grid()) : 0;
        json["segments"] = lattice ? Json(segments) : Json();
        json["skipped_share"] =
            !lattice ? Json()
                     : Json(std::max(
                           0.0, 1.0 - static_cast<double>(timing.samples) /
                                          static_cast<double>(std::max<uint64_t>(1, segments))));
        json["cell_map_ms"] = timing.cell_map_ms;
    }
    if (!scene.surfaces.empty()) {
        json["surfaces"] = Json::array();
        for (const auto& mesh : data.meshes)
            json["surfaces"].push_back(
                {{"triangles", mesh->triangles.size()}, {"vertices", mesh->positions.size()}});
        json["exact_see_through_layers"] = scene.surface_depth;
    }
    json["residency"] = residency_json(timing.first);
    json["peak_rss_bytes"] = peak_rss_bytes();
    // RMSE of colour beside an exact picture of the field: slices have none; null where pictures of
    // this kind were not measured. Fewer rays add their own.
    std::optional<double> error = 0.0;
    if (scene.ray_cast)
        error = estimated_error(scene, data, weight_error(device));
    if (error && timing.interactive)
        *error += timing.interactive->error_estimate;
    json["error_estimate"] = error ? Json(*error) : Json();
    json["volume_version"] = data.volume.version();
    return json;
}

// Colours alone: they already contain the background, and a viewer would blend them once more.
Image without_alpha(const Image& image) {
    Image opaque = make_image(image.size_px, {"R", "G", "B"});
    for (uint32_t y = 0; y < image.size_px.y; ++y)
        for (uint32_t x = 0; x < image.size_px.x; ++x)
            for (size_t c = 0; c < 3; ++c)
                opaque.at(x, y, c) = image.at(x, y, c);
    return opaque;
}

Result<void> save_picture(const std::filesystem::path& path, const Image& image,
                          const RenderOptions& options, const ImageMetadata& metadata) {
    if (path.extension() == ".png")
        return save_png(path, without_alpha(image));
    return save_exr(path, image, options.half ? ExrPrecision::half_float : ExrPrecision::full_float,
                    metadata);
}

// "dir/name_left.png" from "dir/name.png".
std::filesystem::path with_suffix(std::filesystem::path path, const char* suffix) {
    return path.replace_filename(path.stem().string() + suffix + path.extension().string());
}

Result<void> save_frame(const RenderOptions& options, const Scene& scene,
                        const std::vector<Image>& eyes, const ImageMetadata& metadata) {
    const profile::Scope scope("save");
    const std::filesystem::path path = options.output;
    if (eyes.size() == 1)
        return save_picture(path, eyes[0], options, metadata);
    if (scene.stereo->layout == StereoLayout::separate) {
        auto saved = save_picture(with_suffix(path, "_left"), eyes[0], options, metadata);
        return saved ? save_picture(with_suffix(path, "_right"), eyes[1], options, metadata)
                     : saved;
    }
    return save_picture(path, join_eyes(eyes[0], eyes[1], scene.stereo->layout), options, metadata);
}

Result<TexelFormat> texel_format(const std::string& name) {
    if (name == "auto")
        return TexelFormat::automatic;
    if (name == "r16")
        return TexelFormat::unorm16;
    if (name == "r32f")
        return TexelFormat::f32;
    return fail("--volume-format: expected auto, r16 or r32f, found '{}'", name);
}

Result<void> run_render(const RenderOptions& options) {
    for (const std::filesystem::path path : {options.output, options.preview})
        if (!path.empty() && path.extension() != ".png" && path.extension() != ".exr")
            return fail("{}: expected a name ending in .png or .exr", path.string());
    const Result<TexelFormat> format = texel_format(options.format);
    if (!format)
        return fail("{}", format.error().message);
    const Interrupt interrupt;
    Result<SceneFile> file = base_scene(options.scene);
    if (!file)
        return pass_on(file);
    Result<LoadedScene> loaded = load_scene_data(*file, read_options(options.read, interrupt));
    if (!loaded)
        return fail("{}", loaded.error().message);
    if (auto made = make_scene_meshes(*file, *loaded); !made)
        return fail("{}", made.error().message);
    for (const std::string& note : loaded->notes)
        log::info("{}", note);
    for (const std::string& warning : loaded->warnings)
        log::warning("{}", warning);
    Result<Scene> scene = final_scene(options.scene, *file, *loaded);
    if (!scene)
        return fail("{}", scene.error().message);
    if (options.frame_ms > 0 && !scene->ray_cast)
        return fail("--frame-ms: expected a scene with ray casting, found slices alone");
    if (options.frame_ms > 0 && scene->value_and_depth)
        return fail("--frame-ms: values and depths come from a ray a pixel; leave out --values");
    Device device({.select = options.device, .validation = options.validate});
    if (auto met = meet_error(options, device, loaded->data, *scene); !met)
        return met;

    SceneFile drawn = *file;
    drawn.scene = *scene;
    drawn.framing.reset();
    drawn.centered_slices.clear();
    drawn.centered_clips.clear();
    if (!options.write_scene.empty()) {
        const std::string text = write_scene(drawn);
        if (auto saved = save_bytes(options.write_scene, std::as_bytes(std::span(text))); !saved)
            return saved;
    }

    log::debug("drawing on {}, {}", device.info().name, device.info().driver);
    RendererOptions renderer_options{.volume_format = *format, .skipping = !options.no_skipping};
    if (auto applied = apply(options.memory, device, options.frames > 1, renderer_options);
        !applied)
        return applied;
    std::optional<Preview> preview;
    if (!options.preview.empty()) {
        Result<Preview> drawn_first = draw_preview(device, renderer_options, *scene, *loaded);
        if (!drawn_first)
            return fail("{}", drawn_first.error().message);
        preview = std::move(*drawn_first);
        RenderOptions to = options;
        to.output = options.preview;
        if (auto saved = save_frame(to, *scene, preview->eyes, {}); !saved)
            return saved;
        log::info("{}: level {} of the volume, after {:.2f} s", options.preview, preview->level,
                  preview->ms / 1000.0);
    }
    std::optional<Progress> progress(std::in_place, "drawing");
    renderer_options.progress = [&](double share) {
        progress->show(share);
        return !interrupt.token().stop_requested();
    };
    Renderer renderer(device, renderer_options);
    const Result<Timing> timing = draw_frames(renderer, *scene, loaded->data, options, interrupt);
    progress.reset();
    if (!timing)
        return fail("{}", timing.error().message);
    if (timing->interactive && !timing->interactive->complete)
        log::info(
            "an interactive frame: {:.0f} % of the pixels have rays, steps are {} times as "
            "long, error about {:.2g} RMSE",
            100.0 * timing->interactive->traced_share, timing->interactive->step_factor,
            timing->interactive->error_estimate);
    say_residency(timing->first);
    const ImageMetadata metadata{{"palpate:version", PALPATE_VERSION},
                                 {"palpate:device", device.info().name},
                                 {"palpate:driver", device.info().driver},
                                 {"palpate:scene", scene_hash(drawn)}};
    if (auto saved = save_frame(options, *scene, renderer.read_back(), metadata); !saved)
        return saved;
    if (!options.stats.empty() || profile::on())
        say_clocks(*timing);
    if (!options.stats.empty()) {
        const std::string text =
            stats_json(device, renderer, *timing, *scene, loaded->data).dump(2) + "\n";
        if (options.stats == "-")
            fmt::print("{}", text);
        else if (auto saved = save_bytes(options.stats, std::as_bytes(std::span(text))); !saved)
            return saved;
    }
    if (!device.validation_messages().empty())
        return fail("Vulkan validation had {} complaints, the first: {}",
                    device.validation_messages().size(), device.validation_messages().front());
    return {};
}

} // namespace

Command add_render(CLI::App& app) {
    auto o = std::make_shared<RenderOptions>();
    add_scene_options(app, o->scene);
    add_read_limits(app, o->read);
    app.add_option("-o,--output", o->output, "Picture to write: .png (8 bit) or .exr")->required();
    app.add_flag("--half", o->half, "EXR: 16-bit samples (default: 32-bit)");
    app.add_option("--frames", o->frames,
                   "Frames to time, after one that warms up; the last is written")
        ->capture_default_str()
        ->check(CLI::Range(1, 100000));
    app.add_option("--orbit-deg", o->orbit_deg, "Turn between frames, in degrees about up")
        ->capture_default_str();
    CLI::Option* budget =
        app.add_option(
               "--frame-ms", o->frame_ms,
               "Hold this time a frame while the camera turns: fewer rays, longer steps; the "
               "error is estimated in --stats (default: full quality always)")
            ->check(CLI::PositiveNumber);
    app.add_flag("--settle", o->settle,
                 "With --frame-ms: let the last frame rest until it is of full quality")
        ->needs(budget);
    CLI::Option* error =
        app.add_option(
               "--error", o->error,
               "Largest RMSE of colour, 0 .. 1, beside an exact picture of the field; picks "
               "integrator and step from what was measured (default: as given)")
            ->check(CLI::PositiveNumber);
    for (const char* given : {"--integrator", "--step", "--sub-steps", "--frame-ms"})
        error->excludes(app.get_option(given));
    app.add_option("--stats", o->stats,
                   "Write times, passes and resources as JSON to a file, or - (default: none)");
    app.add_option("--write-scene", o->write_scene,
                   "Write the scene that is drawn, all options applied (default: none)");
    app.add_option("--device", o->device,
                   "Vulkan device: part of its name, or its number in palpate doctor (default: the "
                   "first discrete, integrated, then CPU device)");
    add_device_memory_options(app, o->memory);
    app.add_option("--preview", o->preview,
                   "Brick files: first draw a coarse level of the volume to this picture (default: "
                   "none)");
    app.add_option("--volume-format", o->format,
                   "Voxels on the device: r16, r32f, or auto (r32f on CPU devices)")
        ->capture_default_str();
    app.add_flag("--no-skipping", o->no_skipping,
                 "March through empty space, too; the picture is the same, bit for bit");
    app.add_flag("--validate", o->validate, "Run under Vulkan validation; a message is a failure");
    return [o] { return run_render(*o); };
}

} // namespace palpate
