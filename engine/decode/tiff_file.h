#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"

namespace palpate::io {

// A file of which small parts are read anywhere.
class FileParts {
 public:
    static Result<FileParts> open(const std::filesystem::path& path);
    const std::string& name() const { return name_; }
    uint64_t bytes() const { return bytes_; }
    bool big_endian = false;

    // An error where the file does not hold them; `what` they are is said then.
    Result<std::string> take(uint64_t at, uint64_t count, const std::string& what);
    // Up to eight bytes as a number in the file's byte order.
    uint64_t number(std::string_view bytes, size_t at, size_t count) const;

 private:
    FileParts(const std::filesystem::path& path, uint64_t bytes)
        : in_(path, std::ios::binary), name_(path.string()), bytes_(bytes) {}

    std::ifstream in_;
    std::string name_;
    uint64_t bytes_;
};

// Tags of one page of a TIFF or BigTIFF. Sources: TIFF revision 6.0, section 2; the BigTIFF file
// format proposal of libtiff.
struct TiffDirectory {
    struct Entry {
        uint32_t type = 0;
        uint64_t count = 0;
        uint64_t at = 0; // of the values, in the file
    };
    std::map<uint32_t, Entry> tags;
    uint64_t next = 0; // where the next directory is; 0 for none
};

class TiffFile {
 public:
    // Reads the header.
    static Result<TiffFile> open(const std::filesystem::path& path);

    const std::string& name() const { return parts_.name(); }
    uint64_t bytes() const { return parts_.bytes(); }
    bool is_big_endian() const { return parts_.big_endian; }
    bool is_big_tiff() const { return is_big_; }
    uint64_t first_directory() const { return first_; }

    // An error where values of a tag do not lie in the file.
    Result<TiffDirectory> directory(uint64_t at);
    // The values of whole numbers that a tag has; none where there is no such tag.
    Result<std::vector<uint64_t>> numbers(const TiffDirectory& directory, uint32_t tag,
                                          const char* what);
    // A text without the zeros at its end; empty where there is none.
    Result<std::string> text(const TiffDirectory& directory, uint32_t tag, const char* what);
    // A quotient of two whole numbers; absent where there is none, or it is not above 0.
    Result<std::optional<double>> rational(const TiffDirectory& directory, uint32_t tag,
                                           const char* what);

 private:
    explicit TiffFile(FileParts parts) : parts_(std::move(parts)) {}

    FileParts parts_;
    bool is_big_ = false;
    uint64_t first_ = 0;
};

} // namespace palpate::io
