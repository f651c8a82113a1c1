#include "engine/program/picture_options.h"

#include <map>

#include "engine/accuracy/accuracy.h"
#include "engine/base/log.h"
#include "engine/base/option_name.h"
#include "engine/program/option_checks.h"

namespace palpate {

namespace {

const std::map<std::string, TexelFormat> kTexelFormats{
    {"auto", TexelFormat::automatic}, {"r16", TexelFormat::unorm16}, {"r32f", TexelFormat::f32}};

} // namespace

void add_picture_options(CLI::App& app, PictureOptions& o) {
    add_scene_options(app, o.scene);
    add_read_limits(app, o.read);
    add_figure_options(app, o.figure);
    app.add_option("--dpi", o.dots_per_inch,
                   "PNG: dots an inch, by which printing programs choose the size; the pixels stay "
                   "(default: none stated)")
        ->check(within(1.0, 100000.0));
    app.add_flag("--half", o.half, "EXR: 16-bit samples (default: 32-bit)");
    CLI::Option* budget =
        app.add_option("--frame-ms", o.frames.frame_ms,
                       "Time budget a frame in ms while the camera turns, kept by fewer rays and "
                       "longer steps; --stats has an error estimate (default: full quality)")
            ->check(positive());
    app.add_flag("--settle", o.frames.settle,
                 "With --frame-ms: refine the last frame to full quality")
        ->needs(budget);
    CLI::Option* error =
        app.add_option("--error", o.error,
                       "Largest RMSE of colour, 0 .. 1, against an exact picture of the trilinear "
                       "field; chooses integrator and step (default: as given)")
            ->check(positive());
    for (const char* given : {"--integrator", "--step", "--sub-steps", "--frame-ms"})
        error->excludes(app.get_option(given));
    app.add_option("--device", o.device,
                   "Vulkan device: part of its name, or its number in palpate doctor (default: the "
                   "environment variable PALPATE_DEVICE, else the first discrete, integrated, then "
                   "CPU device: palpate native)");
    add_device_memory_options(app, o.memory);
    app.add_option("--volume-format", o.format,
                   "Voxels on the device; auto: r32f on CPU devices (default: auto)")
        ->transform(one_of(kTexelFormats));
    app.add_flag("--no-skipping", o.no_skipping,
                 "Sample empty space as well; the picture is the same, to the bit");
    app.add_flag("--validate", o.validate,
                 "Run under Vulkan validation; a validation message is a failure");
}

Result<void> check_budget(const PictureOptions& options, const Scene& scene) {
    if (options.frames.frame_ms > 0 && !scene.ray_cast)
        return fail("{}: expected a scene with ray casting, found slices alone",
                    Option{"frame-ms"});
    if (options.frames.frame_ms > 0 && scene.value_and_depth)
        return fail("{}: values and depths come from a ray a pixel; leave out {}",
                    Option{"frame-ms"}, Option{"values"});
    return {};
}

RendererOptions renderer_options(const PictureOptions& options, const GpuDevice& device,
                                 bool many_frames) {
    RendererOptions renderer{.volume_format = options.format, .skipping = !options.no_skipping};
    apply(options.memory, device, many_frames, renderer);
    return renderer;
}

Result<void> meet_error(const PictureOptions& options, GpuDevice& device,
                        const RendererOptions& renderer_options, const SceneData& data,
                        Scene& scene) {
    if (options.error <= 0.0)
        return {};
    if (!scene.ray_cast)
        return fail("{}: expected a scene with ray casting, found slices alone", Option{"error"});
    Renderer renderer(device, renderer_options);
    PALPATE_TRY(const AccuracyChoice choice, choose_setting(renderer, scene, data, options.error));
    apply(choice.setting, data.volume.grid(), *scene.ray_cast);
    scene.ray_cast->min_transmittance = choice.min_transmittance;
    log::info("{}: an RMSE of colour of {:.1e} is expected, {:g} was asked for",
              text_of(choice.setting), choice.error_estimate, options.error);
    return {};
}

SceneFile drawn_file(const SceneFile& file, const Scene& scene) {
    SceneFile drawn = file;
    drawn.scene = scene;
    drawn.framing.reset();
    drawn.centered_slices.clear();
    drawn.centered_clips.clear();
    return drawn;
}

ImageMetadata metadata_of(const GpuDevice& device, const SceneFile& drawn) {
    return {{"palpate:version", PALPATE_VERSION},
            {"palpate:device", device.info().name},
            {"palpate:driver", device.info().driver},
            {"palpate:scene", scene_hash(drawn)}};
}

PictureLook look_of(const PictureOptions& options, const OpenedScene& opened, bool moves) {
    const bool transparent = opened.file.transparent;
    return {options.half ? ExrPrecision::half_float : ExrPrecision::full_float, transparent,
            figure_of(options.figure, opened, transparent, moves), options.dots_per_inch};
}

} // namespace palpate
