#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/fd.h"

struct z_stream_s;

namespace palpate::io {

// Writes a file from its beginning, gzipped from some point on if asked for. The same bytes give
// the same file.
class OutputFile {
 public:
    // `name` is how errors call the file; it may differ from the path of a temporary one.
    static Result<OutputFile> create(const std::filesystem::path& path, std::string name);

    // Packs all later bytes as one gzip stream. At most once.
    Result<void> begin_packing();

    Result<void> write(std::span<const std::byte> bytes);
    Result<void> write(std::string_view text) { return write(std::as_bytes(std::span(text))); }

    // Ends the packed stream, waits until the disk has all, and closes. Without it the file is
    // worth nothing.
    Result<void> finish();

 private:
    struct End {
        void operator()(z_stream_s* stream) const;
    };
    OutputFile(std::string name, Fd fd) : name_(std::move(name)), fd_(std::move(fd)) {}
    Result<void> write_file(std::span<const std::byte> bytes);
    Result<void> deflate_all(std::span<const std::byte> bytes, int flush);
    tl::unexpected<Error> failed() const; // with the reason in errno

    std::string name_;
    Fd fd_;
    std::unique_ptr<z_stream_s, End> stream_; // null until begin_packing()
    std::vector<std::byte> packed_;
};

} // namespace palpate::io
