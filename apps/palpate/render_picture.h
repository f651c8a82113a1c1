#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "engine/image/exr.h"
#include "engine/scene/scene.h"

namespace palpate {

// The files that save_frame() writes: `path`, or one for each eye.
std::vector<std::filesystem::path> frame_paths(const std::filesystem::path& path,
                                               std::optional<StereoLayout> layout);

// Writes the eyes of a frame to a .png or .exr: one picture, laid out as the scene asks, or
// NAME_left and NAME_right.
Result<void> save_frame(const std::filesystem::path& path, ExrPrecision precision,
                        const Scene& scene, const std::vector<Image>& eyes,
                        const ImageMetadata& metadata);

} // namespace palpate
