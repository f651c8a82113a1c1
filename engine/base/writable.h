#pragma once

#include <filesystem>

#include "engine/base/error.h"

namespace palpate {

// Whether write_atomically() can begin: the path is absent or a file, and its folder is writable.
// For commands that work long before they write.
Result<void> expect_writable(const std::filesystem::path& path);

} // namespace palpate
