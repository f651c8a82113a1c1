#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "engine/base/error.h"
#include "engine/image/image.h"

namespace palpate {

// How samples are stored. `half_float` keeps 11 significant bits and turns values beyond 65504 into
// infinity: enough for colours, too coarse for grey values and distances, which need `full_float`.
enum class ExrPrecision { half_float, full_float };

// Facts about a picture, kept in the file as string attributes. Names must not be those of the
// attributes every EXR file has ("channels", "dataWindow", ...).
using ImageMetadata = std::map<std::string, std::string>;

struct ExrFile {
    Image image; // channels in the order R, G, B, A, then the others by name
    ImageMetadata metadata;
};

// Writes a scanline OpenEXR file with every channel under its own name, ZIP-compressed (lossless).
// The file is a function of the arguments alone: it carries no time and no host. NaN and infinity
// are kept; with `full_float` every bit is.
Result<void> save_exr(const std::filesystem::path& path, const Image& image, ExrPrecision precision,
                      const ImageMetadata& metadata = {});

// Reads a flat scanline OpenEXR file of any compression; samples of any type become floats, the
// picture is the data window. Tiled, deep, multi-part and subsampled files are refused by kind, and
// claims beyond the limits of image.h or beyond the file's own length before anything is allocated.
Result<ExrFile> load_exr(const std::filesystem::path& path);

} // namespace palpate
