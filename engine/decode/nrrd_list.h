#pragma once

#include "engine/decode/payload.h"

namespace palpate::io {

// The files of a NRRD "data file" that is a printf pattern with one number and its range:
// "slice.%d 1 93 1" (first, last, step; inclusive, either direction). All lie beside the header.
// Absent where `data_file` has no such form.
Result<std::optional<std::vector<std::filesystem::path>>> nrrd_file_list(
    const std::filesystem::path& header, const std::string& data_file);

// Reads raw voxels that are spread evenly over several files, each of which holds as many bytes as
// the others after payload.skip. Refused with both numbers where one does not.
Result<void> read_file_list(const Payload& payload, const std::vector<std::filesystem::path>& files,
                            VoxelSink& sink);

} // namespace palpate::io
