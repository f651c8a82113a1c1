#pragma once

#include <span>

#include "engine/io/decoder.h"

// One PNG, TIFF, JPEG or BMP file, read through ITK, JPEG through libjpeg. The only header between
// ITK and the rest.
namespace palpate::io {

struct PictureHeader {
    glm::uvec3 size{}; // columns, rows, pages
    ComponentType type{};
    uint32_t components = 1;
};

// Whether an extension (lower case, with the dot) is one of a picture.
bool is_picture(std::string_view extension);

// Checks the whole file where the format tells (picture_check.h). An error names the file and what
// it is instead.
Result<PictureHeader> read_picture_header(const std::filesystem::path& path);

// After read_picture_header(). Fills `voxels`, which holds exactly what the header claims: top row
// first, as pictures are seen.
Result<void> read_picture(const std::filesystem::path& path, std::span<std::byte> voxels);

} // namespace palpate::io
