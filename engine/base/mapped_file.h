#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

#include "engine/base/error.h"
#include "engine/base/fd.h"

namespace palpate {

// A regular file mapped into memory for reading.
//
// Reading beyond the end of a file that another process truncated ends this process (SIGBUS): call
// is_whole() before touching pages.
class MappedFile {
 public:
    // An error names the file. A file of 0 bytes maps to nothing.
    static Result<MappedFile> open(const std::filesystem::path& path);
    ~MappedFile();
    MappedFile(MappedFile&&) noexcept;
    MappedFile& operator=(MappedFile&&) = delete;

    std::span<const std::byte> bytes() const { return bytes_; }

    // Whether the file is still as long as when it was opened; else `now_bytes` is its length.
    bool is_whole(uint64_t& now_bytes) const;

    // Counts `bytes` as read. Every 64 MiB the pages are handed back to the system's file cache, so
    // that a pass over a large file does not make this process look large.
    void count_read(uint64_t bytes) const;

 private:
    explicit MappedFile(Fd fd) : fd_(std::move(fd)) {}
    Fd fd_;
    std::span<const std::byte> bytes_;
    mutable std::atomic<uint64_t> read_since_ = 0;
};

} // namespace palpate
