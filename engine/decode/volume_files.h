#pragma once

#include <filesystem>
#include <vector>

namespace palpate::io {

// The files that reading a volume of this name opens, as far as they can be told without reading
// voxels: the file itself; with a header (.mhd, .nhdr) those that hold its voxels; the slices of a
// pattern; a folder as itself. What cannot be read is left out: reading it says why.
std::vector<std::filesystem::path> volume_files(const std::filesystem::path& path);

} // namespace palpate::io
