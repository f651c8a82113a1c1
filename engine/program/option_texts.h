#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "engine/scene/scene_file.h"

// Values of options that are texts of several parts. The errors of readers state the expected and
// the found text, without the option's name.
namespace palpate {

// "1,2.5" with ',' is {1, 2.5}; absent where a piece is no finite number.
std::optional<std::vector<double>> numbers_of(std::string_view text, char separator);

// "axial", "coronal:-12.5" (mm, LPS) or "px,py,pz,nx,ny,nz". A plane without a place goes through
// center_mm.
Result<SliceLayer> read_slice(const std::string& text, glm::dvec3 center_mm = {});

// "px,py,pz,nx,ny,nz".
Result<ClipPlane> read_clip(const std::string& text);

// "r,g,b", 0 .. 1.
Result<glm::dvec3> read_color(const std::string& text);

// The same, or "black", "white", or "transparent", which is black.
Result<glm::dvec3> read_background(const std::string& text);

// "labels", "iso=300" or a file.
Result<SurfaceSource> read_surface(const std::string& text);

} // namespace palpate
