#pragma once

#include <span>

#include "engine/decode/picture.h"

namespace palpate::io {

// A JPEG file that check_jpeg() has found whole: grey, or colours as RGB. An error names the file
// and says what libjpeg says of it; CMYK is refused. Damaged pixels, which libjpeg would fill with
// grey, are errors, too.
Result<PictureHeader> read_jpeg_header(const std::filesystem::path& path);
Result<void> read_jpeg(const std::filesystem::path& path, std::span<std::byte> pixels);

} // namespace palpate::io
