#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/fd.h"

struct z_stream_s;

namespace palpate::io {

// How bytes are packed in a file. `deflate` is gzip (several members too) or a zlib stream;
// `bare_deflate` has no header.
enum class Packing : uint8_t { none, deflate, bare_deflate };

// How a file is packed: gzip, by its first two bytes, or not. An error names the file.
Result<Packing> packing_of(const std::filesystem::path& path);

// Turns each word of 1, 2, 4 or 8 bytes to the other byte order.
void swap_bytes(std::span<std::byte> bytes, size_t word_bytes);

// Reads a file forward from an offset on, unpacking on the way.
class ByteSource {
 public:
    // An error names the file when it cannot be opened.
    static Result<ByteSource> open(const std::filesystem::path& path, Packing packing,
                                   uint64_t offset = 0);

    // Fills `out`, or as much of it as there is before the end, and returns how much that was.
    // An error when the packed bytes are damaged or end too early.
    Result<size_t> read(std::span<std::byte> out);

    // Passes over `count` bytes, or as many as there are; returns how many.
    Result<uint64_t> skip(uint64_t count);

 private:
    struct End {
        void operator()(z_stream_s* stream) const;
    };
    ByteSource(std::filesystem::path path, Fd fd) : path_(std::move(path)), fd_(std::move(fd)) {}
    Result<size_t> read_file(std::span<std::byte> out);
    Result<bool> refill();     // false at the end of the file
    Result<bool> begin_next(); // true when another gzip member follows

    std::filesystem::path path_;
    Fd fd_;
    std::unique_ptr<z_stream_s, End> stream_; // null for Packing::none, and after the last member
    std::vector<std::byte> packed_;
};

} // namespace palpate::io
