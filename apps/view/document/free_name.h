#pragma once

#include <cstdint>
#include <filesystem>

namespace palpate::view {

// The first of NAME, NAME-1, NAME-2, .. with the ending of `name` that names nothing yet, so that
// no file is replaced: "labels-1.nii.gz". `number` is the first one tried; 0: the name as it is. Of
// .mhd the .raw beside it is free, too.
std::filesystem::path free_name(const std::filesystem::path& name, uint32_t number = 0);

} // namespace palpate::view
