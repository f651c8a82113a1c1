#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "engine/annotate/figure.h"
#include "engine/image/exr.h"
#include "engine/scene/scene.h"

namespace palpate {

// The files that save_frame() writes: `path`, or one for each eye.
std::vector<std::filesystem::path> frame_paths(const std::filesystem::path& path,
                                               std::optional<StereoLayout> layout);

// How a frame becomes a picture.
struct PictureLook {
    ExrPrecision precision = ExrPrecision::full_float;
    // The background is; the scene's is black. An EXR then has colours associated with alpha, as
    // always, and a PNG has straight ones.
    bool transparent = false;
    Figure figure{};
    double dots_per_inch = 0.0; // of a PNG; 0: it states none
};

// The eyes of a frame as one picture with marks, laid out as the scene asks (separate eyes side by
// side); with the channels of a PNG where `colors_alone`, else all.
Image shown_picture(const PictureLook& look, const Scene& scene, std::vector<Image> eyes,
                    bool colors_alone);

// Writes the eyes of a frame, with marks, to a .png or .exr: one picture, laid out as the scene
// asks, or NAME_left and NAME_right.
Result<void> save_frame(const std::filesystem::path& path, const PictureLook& look,
                        const Scene& scene, std::vector<Image> eyes, const ImageMetadata& metadata);

} // namespace palpate
