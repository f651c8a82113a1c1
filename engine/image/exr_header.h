#pragma once

#include <filesystem>
#include <string_view>

#include "engine/base/error.h"

namespace palpate {

// Walks the header of an EXR file before OpenEXR sees it, because the library allocates what a
// header claims. Passes what is one flat scanline picture whose attributes lie within the file,
// whose size is within the limits of image.h (rows rounded up to what is compressed together, as
// the library buffers that many), and whose table of chunks fits into the file.
// Layout: "OpenEXR File Layout", openexr.com.
Result<void> check_exr_header(const std::filesystem::path& path, std::string_view bytes);

} // namespace palpate
