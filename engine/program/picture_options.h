#pragma once

#include <string>

#include "engine/gpu/device.h"
#include "engine/program/device_options.h"
#include "engine/program/figure_options.h"
#include "engine/program/open_scene.h"
#include "engine/program/render_picture.h"
#include "engine/program/render_timing.h"

namespace palpate {

// The options of `palpate render` that decide a picture: the scene, its marks, the device and the
// error. Python's palpate.render() takes the same by name.
struct PictureOptions {
    SceneOptions scene;
    ReadFlags read;
    FigureOptions figure;
    DeviceMemoryOptions memory;
    FrameOptions frames; // --frame-ms and --settle of it
    std::string device;
    TexelFormat format = TexelFormat::automatic;
    double error = 0.0; // 0: as integrator and step say
    double dots_per_inch = 0.0;
    bool half = false, validate = false, no_skipping = false;

    DeviceOptions device_options() const { return {.select = device, .validation = validate}; }
};
void add_picture_options(CLI::App& app, PictureOptions& options);

// Fails where a budget of time does not suit the scene.
Result<void> check_budget(const PictureOptions& options, const Scene& scene);

// `many_frames` as apply() takes it.
RendererOptions renderer_options(const PictureOptions& options, const GpuDevice& device,
                                 bool many_frames);

// --error: gives `scene` the fastest setting with which its picture errs less. Nothing without it.
Result<void> meet_error(const PictureOptions& options, GpuDevice& device,
                        const RendererOptions& renderer_options, const SceneData& data,
                        Scene& scene);

// The scene file of the picture, with all options applied.
SceneFile drawn_file(const SceneFile& file, const Scene& scene);
// Facts that an EXR of it keeps.
ImageMetadata metadata_of(const GpuDevice& device, const SceneFile& drawn);
// `moves`: it is a frame of a movie.
PictureLook look_of(const PictureOptions& options, const OpenedScene& opened, bool moves = false);

} // namespace palpate
