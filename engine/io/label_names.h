#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"

namespace palpate {

// Name and colour of one label of a label map, as a file states them.
struct LabelName {
    uint32_t label = 0;
    std::string name;                // as the file states it; may be empty
    std::optional<glm::dvec3> color; // sRGB, each 0 .. 1

    friend bool operator==(const LabelName&, const LabelName&) = default;
};

// Reads a table of labels, a line each, as programs write it beside a label map: of ITK-SNAP
// (number, red, green, blue 0 .. 255, opacity, visible, shown as mesh, "name"), of 3D Slicer and
// FreeSurfer (number, name, and red, green, blue 0 .. 255 where they have a colour). Lines that
// begin with # and empty ones are passed over, and so is label 0. An error names file and line.
Result<std::vector<LabelName>> load_label_table(const std::filesystem::path& path);

// The sRGB colour of CIELAB coordinates relative to the white D50, as DICOM and ICC use them: L* in
// 0 .. 100, a* and b* in -128 .. 127. Adapted to the white D65 after Bradford; what sRGB cannot
// show is clamped.
glm::dvec3 color_of_cielab(glm::dvec3 lab);
// The inverse.
glm::dvec3 cielab_of_color(glm::dvec3 srgb);

} // namespace palpate
