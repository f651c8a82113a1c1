#pragma once

#include <filesystem>

#include "engine/base/error.h"

namespace palpate {

// Whether write_atomically() can begin: what is there is a file if it is anything, and its folder
// can be written. For commands that work long before they write.
Result<void> expect_writable(const std::filesystem::path& path);

} // namespace palpate
