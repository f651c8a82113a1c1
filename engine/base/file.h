#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include "engine/base/error.h"

namespace palpate {

// Writes a file whole or not at all.
//
// `write(temporary)` fills a file of another name in the same folder; when it succeeds the file is
// synced and renamed to `path`, else (also when it throws) it is removed. A program killed in
// between leaves at most the temporary file, named ".<process>.tmp.<name>", never a partial `path`.
// The temporary name ends as `path` does, because some writers choose the format by it. Where
// `path` is a link to a file, that file is written, and the link stays.
Result<void> write_atomically(
    const std::filesystem::path& path,
    const std::function<Result<void>(const std::filesystem::path& temporary)>& write);

// The same for bytes at hand.
Result<void> save_bytes(const std::filesystem::path& path, std::span<const std::byte> bytes);

// A whole text file; refused when larger than `limit_bytes` or not a regular file.
Result<std::string> load_text(const std::filesystem::path& path, uint64_t limit_bytes = 64 << 20);

} // namespace palpate
