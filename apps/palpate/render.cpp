#include <filesystem>

#include "apps/palpate/command.h"
#include "apps/palpate/preview.h"
#include "apps/palpate/render_report.h"
#include "apps/palpate/written_scene.h"
#include "engine/base/file.h"
#include "engine/base/log.h"
#include "engine/base/percentile.h"
#include "engine/base/profile.h"
#include "engine/program/option_checks.h"
#include "engine/program/output.h"
#include "engine/program/picture_options.h"
#include "engine/program/progress.h"
#include "engine/program/render_warnings.h"
#include "engine/program/turntable.h"
#include "engine/render/display_layout.h"

namespace palpate {

namespace {

struct RenderOptions : PictureOptions {
    TurntableOptions turntable;
    std::string preview, output, stats, write_scene;
};

// Those of the options, and those that the scene names.
std::vector<NamedFile> files_of(const RenderOptions& options) {
    const Result<SceneFile> scene = base_scene(options.scene);
    const std::optional<StereoLayout> layout =
        stereo_layout(options.scene, scene ? scene->scene : Scene{});
    std::vector<NamedFile> files{{"--tf", options.scene.transfer}};
    append_volume(files, "SCENE", options.scene.input);
    append_volume(files, "--volume", options.scene.volume);
    append_volume(files, "--labels", options.scene.labels);
    files.push_back({"--label-names", options.scene.label_names});
    append_volume(files, "--fused", options.scene.fused);
    append_volume(files, "--overlay", options.scene.overlay);
    std::vector<std::string> outputs = frame_names(options.turntable, options.output);
    if (outputs.empty())
        outputs.push_back(options.output);
    for (const std::string& output : outputs)
        for (const std::filesystem::path& path : frame_paths(output, layout))
            files.push_back({"-o", path.string(), FileUse::write});
    for (const std::string& scene_of_path : options.turntable.path)
        append_volume(files, "--camera-path", scene_of_path);
    for (const std::filesystem::path& path : frame_paths(options.preview, layout))
        files.push_back({"--preview", path.string(), FileUse::write});
    files.insert(files.end(), {{"--stats", options.stats, FileUse::write_text},
                               {"--write-scene", options.write_scene, FileUse::write_text}});
    if (scene) { // else it is told later
        append_files(*scene, files);
        for (const SurfaceSource& surface : scene->surfaces)
            if (!surface.mesh.empty())
                files.push_back(
                    {options.scene.surfaces.empty() ? "a surface of SCENE" : "--surface",
                     volume_path(*scene, surface.mesh).string()});
    }
    return files;
}

// One line where frames took longer than --frame-ms, and why no fewer rays were cast.
void warn_of_missed_budget(const Timing& timing, const FrameOptions& frames) {
    const double median_ms = percentile(timing.wall_ms, 0.5);
    if (!timing.interactive || median_ms <= frames.frame_ms)
        return;
    log::warning("--frame-ms {:g}: {} took {:.0f} ms, {}", frames.frame_ms,
                 frames.frames > 1 ? "half of the frames" : "the frame", median_ms,
                 timing.coarsest      ? "with the fewest rays there are, one in 16 x 16 pixels"
                 : frames.frames == 1 ? "the first has none before it to go by: ask for --frames"
                 : timing.moving      ? "before rays were few enough: ask for more --frames"
                                      : "for a row of tiles, the least that is drawn at rest");
}

Result<void> expect_valid(const GpuDevice& device) {
    if (!device.validation_messages().empty())
        return fail("Vulkan validation had {} complaints, the first: {}",
                    device.validation_messages().size(), device.validation_messages().front());
    return {};
}

Result<void> check_names(const RenderOptions& options) {
    PALPATE_TRY(check_together(options.turntable, options.output));
    for (const std::filesystem::path path : {options.output, options.preview}) {
        const bool movie = options.turntable.frames > 0 && path.extension() == ".mp4";
        if (!path.empty() && path.extension() != ".png" && path.extension() != ".exr" && !movie)
            return fail("{}: expected a name ending in .png or .exr", path.string());
        if (movie && options.scene.stereo == StereoLayout::separate)
            return fail("{}: expected one picture a frame, found --stereo separate", path.string());
    }
    return {};
}

// --turntable: a picture of each camera.
Result<void> draw_pictures(const RenderOptions& options, const SceneData& data, SceneFile drawn,
                           const PictureLook& look, GpuDevice& device,
                           RendererOptions renderer_options, const std::stop_token& stop) {
    Progress progress("drawing");
    uint32_t done = 0;
    renderer_options.progress = [&](double share) {
        progress.show((done + share) / options.turntable.frames);
        return !stop.stop_requested();
    };
    Renderer renderer(device, renderer_options);
    const auto draw = [&](const Camera& camera, const std::string& file) -> Result<void> {
        drawn.scene.camera = camera;
        PALPATE_TRY(renderer.draw(drawn.scene, data));
        ++done;
        return save_frame(file, look, drawn.scene, renderer.read_back(),
                          metadata_of(device, drawn));
    };
    PALPATE_TRY(draw_turntable(options.turntable, drawn.scene.camera, data.volume.grid(),
                               options.output, draw, stop));
    return expect_valid(device);
}

Result<void> run_render(const RenderOptions& options, const CLI::App& app) {
    PALPATE_TRY(check_names(options));
    const Interrupt interrupt;
    PALPATE_TRY(OpenedScene opened, open_scene(options.scene, options.read, interrupt));
    make_room_for_legend(options.figure, options.scene, opened);
    auto& [file, loaded, scene] = opened;
    const SceneToDraw to_draw{options.scene, file, scene, loaded};
    warn_of_idle_options(app, to_draw, options.output, options.frames.frames);
    if (const std::string idle = idle_mark(options.figure, opened); !idle.empty())
        log::warning("{}", idle);
    const std::vector<std::string> empty = empty_parts(to_draw);
    for (const std::string& sentence : empty)
        log::warning("{}", sentence);
    PALPATE_TRY(check_budget(options, scene));
    GpuDevice device(options.device_options());
    RendererOptions renderer_options =
        palpate::renderer_options(options, device, options.frames.frames > 1);
    PALPATE_TRY(meet_error(options, device, renderer_options, loaded.data, scene));
    const SceneFile drawn = drawn_file(file, scene);
    if (!options.write_scene.empty())
        PALPATE_TRY(write_text(
            options.write_scene,
            write_scene(scene_to_write(drawn, file, options.scene, options.write_scene))));

    log::debug("drawing on {}, {}", device.info().name, device.info().driver);
    const PictureLook look = look_of(options, opened, options.turntable.frames > 0);
    if (options.turntable.frames > 0)
        return draw_pictures(options, loaded.data, drawn, look, device, renderer_options,
                             interrupt.token());
    std::optional<Preview> preview;
    if (!options.preview.empty()) {
        PALPATE_TRY(preview, draw_preview(device, renderer_options, scene, loaded));
        FilesTogether at_once; // for who waits for it
        PALPATE_TRY(save_frame(options.preview, look, scene, preview->eyes, {}));
        PALPATE_TRY(at_once.commit());
        log::info("{}: level {} of the volume, after {:.2f} s", options.preview, preview->level,
                  preview->ms / 1000.0);
    }
    std::optional<Progress> progress(std::in_place, "drawing");
    renderer_options.progress = [&](double share) {
        progress->show(share);
        return !interrupt.token().stop_requested();
    };
    Renderer renderer(device, renderer_options);
    const Result<Timing> timing = draw_frames(renderer, scene, loaded.data, options.frames,
                                              !options.stats.empty(), interrupt.token());
    progress.reset();
    if (!timing)
        return fail("{}", timing.error().message);
    if (timing->interactive && !timing->interactive->complete)
        log::info(
            "an interactive frame: {:.2g} % of the pixels have rays, steps are {} times as "
            "long, error about {:.2g} RMSE",
            100.0 * timing->interactive->traced_share, timing->interactive->step_factor,
            timing->interactive->error_estimate);
    warn_of_missed_budget(*timing, options.frames);
    say_residency(timing->first);
    const std::vector<Image> eyes = renderer.read_back();
    PALPATE_TRY(save_frame(options.output, look, scene, eyes, metadata_of(device, drawn)));
    const DisplayLayout display = display_layout(scene);
    if (display.layout != StereoLayout::separate) { // which has two files
        const glm::uvec2 size_px = display_size_px(scene.size_px, display.layout);
        tell_made(options.output, fmt::format("{} x {} pixels", size_px.x, size_px.y));
    }
    if (empty.empty() && is_one_color(eyes))
        log::warning(
            "{}: the picture has one colour: this camera, mode and transfer function show nothing "
            "of the volume, whose values are {:g} .. {:g}",
            options.output, loaded.data.volume.range().min, loaded.data.volume.range().max);
    // A single frame also creates pipelines and uploads, which the GPU's clock does not see.
    if (options.frames.frames > 1 && (!options.stats.empty() || profile::on()))
        say_clocks(*timing);
    if (!options.stats.empty()) {
        const std::string text =
            report_text(stats_json(device, renderer, *timing, scene, loaded.data));
        PALPATE_TRY(write_text(options.stats, text));
    }
    return expect_valid(device);
}

} // namespace

Command add_render(CLI::App& app) {
    auto o = std::make_shared<RenderOptions>();
    add_picture_options(app, *o);
    app.add_option("-o,--output", o->output, "Picture to write: .png (8 bit) or .exr")->required();
    app.add_option("--frames", o->frames.frames,
                   "Frames to time, after one to warm up; the last is written. 1 times the first "
                   "frame, with pipelines and uploads")
        ->capture_default_str()
        ->check(CLI::Range(1, 100000));
    app.add_option("--orbit-deg", o->frames.orbit_deg,
                   "Turn of the camera between frames, in degrees about up")
        ->capture_default_str();
    app.add_option("--stats", o->stats,
                   "Write times, passes and resources as JSON to a file, or - (default: none)");
    app.add_option(
        "--write-scene", o->write_scene,
        "Write the scene with all options applied to a file, or - (default: none); files "
        "near it are named relative to it, and a camera of --view stays that view");
    app.add_option("--preview", o->preview,
                   "Brick files: first draw a coarse level of the volume to this picture (default: "
                   "none)");
    add_turntable_options(app, o->turntable);
    return {[o, &app] { return run_render(*o, app); }, [o] { return files_of(*o); }};
}

} // namespace palpate
