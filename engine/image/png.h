#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/image/image.h"

namespace palpate {

// Writes the channels R, G, B, and A where there is one, as 8-bit PNG, by display_byte().
// Other channels stay behind; an image without R, G and B is refused. The file is a
// function of the arguments alone: it carries no time. `dots_per_inch` is written as a density of
// whole pixels a metre, by which printing programs choose the size; 0 writes none.
Result<void> save_png(const std::filesystem::path& path, const Image& image,
                      double dots_per_inch = 0.0);

// The bytes of that file. `name` begins an error.
Result<std::vector<std::byte>> encode_png(const std::string& name, const Image& image,
                                          double dots_per_inch = 0.0);

// Reads a PNG of any kind: 8-bit samples become v / 255, 16-bit ones v / 65535, narrower ones and
// palettes are widened to 8 bits. Channels are "Y" for grey and "R", "G", "B" for colour, then "A"
// where the file has alpha or a transparent colour. Stored values are taken as they are: gamma and
// colour profiles are not applied. Claims beyond the limits of image.h, or beyond what deflate can
// hold in a file of this length, are refused before the picture is allocated.
Result<Image> load_png(const std::filesystem::path& path);

} // namespace palpate
