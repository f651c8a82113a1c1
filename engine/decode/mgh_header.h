#pragma once

#include <cstddef>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include "engine/io/decoder.h"

namespace palpate::io {

// Bytes before the first voxel, of which those after the fields below are unused.
constexpr size_t kMghHeaderBytes = 284;

// The header of a FreeSurfer volume (.mgh, or gzipped .mgz), big-endian throughout. Source:
// "FsTools MGH format" in FreeSurfer's documentation. Scan parameters and tags that follow the
// voxels are not read.
struct MghHeader {
    glm::uvec3 size{};
    uint32_t frames = 1;
    ComponentType type{};
    bool has_geometry = false; // else the three below hold what FreeSurfer assumes then
    glm::dvec3 spacing_mm{1};
    // Unit vectors of the index axes in RAS. Those assumed are of coronal slices: x leads to the
    // patient's left, y down, z to the front.
    glm::dmat3 directions{{-1, 0, 0}, {0, 0, -1}, {0, 1, 0}};
    glm::dvec3 center_mm{}; // RAS of index size / 2, also where a size is odd
};

// From the first kMghHeaderBytes of a file, unpacked. An error begins with `name`.
Result<MghHeader> parse_mgh_header(const std::string& name, std::span<const std::byte> bytes);

// The places of the samples, LPS millimetres; a warning where the file does not say.
Result<Grid> mgh_grid(const std::string& name, const MghHeader& header,
                      std::vector<std::string>& warnings);

} // namespace palpate::io
