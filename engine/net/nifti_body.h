#pragma once

#include <cstddef>
#include <stop_token>
#include <vector>

#include "engine/base/error.h"
#include "engine/volume/volume.h"

namespace palpate {

// A volume as the bytes of a .nii.gz, in memory: it goes to no file on its way to a server.
// Refused: a stop.
Result<std::vector<std::byte>> nifti_body(const Volume& volume, const std::stop_token& stop);

} // namespace palpate
