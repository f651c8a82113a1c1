#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <map>
#include <set>
#include <string>

#include "engine/decode/header_fields.h"
#include "engine/decode/picture_check.h"
#include "engine/io/decoder.h"

namespace palpate::io {

namespace {

// A file of which small parts are read anywhere.
class Parts {
 public:
    static Result<Parts> open(const std::filesystem::path& path) {
        PALPATE_TRY(const uint64_t bytes, regular_file_bytes(path));
        return Parts(path, bytes);
    }
    const std::string& name() const { return name_; }
    uint64_t bytes() const { return bytes_; }
    bool big_endian = false;

    // An error where the file does not hold them; `what` they are is said then.
    Result<std::string> take(uint64_t at, uint64_t count, const std::string& what) {
        if (at > bytes_ || count > bytes_ - at)
            return fail("{}: expected {} in bytes {} to {}, found the end of the file at byte {}",
                        name_, what, at, at + count, bytes_);
        std::string out(count, '\0');
        in_.seekg(static_cast<std::streamoff>(at));
        in_.read(out.data(), static_cast<std::streamsize>(count));
        if (!in_)
            return fail("{}: cannot be read at byte {}", name_, at);
        return out;
    }
    uint32_t number(std::string_view bytes, size_t at, size_t count) const {
        return number_of(bytes.substr(at, count), big_endian);
    }

 private:
    Parts(const std::filesystem::path& path, uint64_t bytes)
        : in_(path, std::ios::binary), name_(path.string()), bytes_(bytes) {}

    std::ifstream in_;
    std::string name_;
    uint64_t bytes_;
};

// ---- BMP ----

// Run-length codes: pairs of bytes up to the end mark, of runs that lie within the picture.
Result<void> check_runs(const Parts& file, std::string_view codes, uint64_t begin, uint32_t width,
                        uint32_t height) {
    uint64_t x = 0, y = 0;
    for (size_t at = 0; at + 2 <= codes.size();) {
        const auto count = static_cast<unsigned char>(codes[at]);
        const auto code = static_cast<unsigned char>(codes[at + 1]);
        at += 2;
        if (count > 0) {
            x += count;
        } else if (code == 0) {
            x = 0;
            ++y;
        } else if (code == 1) {
            return {};
        } else if (code == 2 && at + 2 <= codes.size()) {
            x += static_cast<unsigned char>(codes[at]);
            y += static_cast<unsigned char>(codes[at + 1]);
            at += 2;
        } else {
            x += code;
            at += (code + 1u) / 2 * 2;
        }
        if (x > width || y > height || (y == height && x > 0))
            return fail("{}: expected runs within {} x {} pixels, found one beyond at byte {}",
                        file.name(), width, height, begin + at);
    }
    return fail("{}: expected the end mark of its runs, found the end of the file at byte {}",
                file.name(), file.bytes());
}

// ---- TIFF ----

// Bytes of one value by its type, 1 .. 12; 0 where there is no such type.
uint32_t bytes_of_type(uint32_t type) {
    constexpr uint32_t bytes[] = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8};
    return type < std::size(bytes) ? bytes[type] : 0;
}

struct Entry {
    uint32_t type = 0, count = 0;
    uint64_t at = 0; // of the values
};

using Directory = std::map<uint32_t, Entry>; // by tag

constexpr uint32_t kMostValues = 1 << 22;

// The values of whole numbers that a tag has.
Result<std::vector<uint64_t>> values_of(Parts& file, const Directory& tags, uint32_t tag,
                                        const char* what) {
    const auto found = tags.find(tag);
    std::vector<uint64_t> values;
    if (found == tags.end())
        return values;
    const Entry& entry = found->second;
    if ((entry.type != 1 && entry.type != 3 && entry.type != 4) || entry.count == 0 ||
        entry.count > kMostValues)
        return fail("{}: expected whole numbers as {} (tag {}), found {} of type {}", file.name(),
                    what, tag, entry.count, entry.type);
    const uint32_t each = bytes_of_type(entry.type);
    PALPATE_TRY(const std::string bytes, file.take(entry.at, uint64_t{each} * entry.count, what));
    for (uint32_t i = 0; i < entry.count; ++i)
        values.push_back(file.number(bytes, size_t{i} * each, each));
    return values;
}

// One directory at `at`; returns where the next is, 0 for none.
Result<uint32_t> read_directory(Parts& file, uint64_t at, Directory& tags) {
    PALPATE_TRY(const std::string count, file.take(at, 2, "the number of tags"));
    const uint32_t entries = file.number(count, 0, 2);
    PALPATE_TRY(const std::string bytes, file.take(at + 2, 12 * entries + 4, "the tags"));
    for (uint32_t i = 0; i < entries; ++i) {
        const uint32_t tag = file.number(bytes, 12 * i, 2);
        Entry entry{file.number(bytes, 12 * i + 2, 2), file.number(bytes, 12 * i + 4, 4), 0};
        const uint64_t size = uint64_t{bytes_of_type(entry.type)} * entry.count;
        entry.at = size <= 4 ? at + 2 + 12 * i + 8 : file.number(bytes, 12 * i + 8, 4);
        if (entry.at + size > file.bytes())
            return fail(
                "{}: expected the values of tag {} in bytes {} to {}, found the end of the "
                "file at byte {}",
                file.name(), tag, entry.at, entry.at + size, file.bytes());
        tags.emplace(tag, entry);
    }
    return file.number(bytes, 12 * entries, 4);
}

// The strips or tiles of one page lie in the file.
Result<void> check_page(Parts& file, const Directory& tags) {
    for (const auto& [tag, what] : {std::pair(256, "its width"), {257, "its height"}}) {
        PALPATE_TRY(const std::vector<uint64_t> side,
                    values_of(file, tags, static_cast<uint32_t>(tag), what));
        if (side.size() != 1 || side.front() == 0)
            return fail("{}: expected one number above 0 as {} (tag {}), found {}", file.name(),
                        what, tag, side.empty() ? "none" : std::to_string(side.front()));
    }
    const bool tiled = tags.contains(324);
    PALPATE_TRY(const std::vector<uint64_t> at,
                values_of(file, tags, tiled ? 324 : 273, "the places of its pixels"));
    PALPATE_TRY(const std::vector<uint64_t> bytes,
                values_of(file, tags, tiled ? 325 : 279, "the sizes of its pixels"));
    if (at.empty())
        return fail("{}: expected the places of its pixels (tag 273 or 324), found none",
                    file.name());
    if (!bytes.empty() && bytes.size() != at.size())
        return fail("{}: expected as many sizes as places of its pixels, found {} and {}",
                    file.name(), bytes.size(), at.size());
    for (size_t i = 0; i < at.size(); ++i)
        if (const uint64_t size = bytes.empty() ? 1 : bytes[i];
            at[i] > file.bytes() || size > file.bytes() - at[i])
            return fail(
                "{}: expected pixels in bytes {} to {}, found the end of the file at byte "
                "{}",
                file.name(), at[i], at[i] + size, file.bytes());
    return {};
}

} // namespace

Result<void> check_bmp(const std::filesystem::path& path) {
    PALPATE_TRY(Parts file, Parts::open(path));
    PALPATE_TRY(const std::string head, file.take(0, 54, "the header of a BMP"));
    if (!head.starts_with("BM"))
        return fail("{}: expected a BMP that begins with BM, found other bytes", path.string());
    const uint32_t begin = file.number(head, 10, 4), size = file.number(head, 14, 4);
    const auto width = static_cast<int32_t>(file.number(head, 18, 4));
    const auto rows = static_cast<int32_t>(file.number(head, 22, 4));
    const uint32_t bits = file.number(head, 28, 2), packing = file.number(head, 30, 4);
    const uint64_t height = static_cast<uint64_t>(std::abs(int64_t{rows}));
    if (size < 40 || size > 124)
        return fail("{}: expected a header of 40 to 124 bytes, found {}", path.string(), size);
    if (width < 1 || height < 1)
        return fail("{}: expected a size of at least 1 x 1, found {} x {}", path.string(), width,
                    rows);
    if (bits != 8 && bits != 24 && bits != 32)
        return fail("{}: expected 8, 24 or 32 bits a pixel, found {}", path.string(), bits);
    if (packing > 1 || (packing == 1 && bits != 8))
        return fail("{}: expected pixels as they are or runs of 8 bits, found compression {}",
                    path.string(), packing);
    if (begin < 14 + size)
        return fail("{}: expected pixels behind the header of {} bytes, found them at byte {}",
                    path.string(), 14 + size, begin);
    if (packing == 1) {
        PALPATE_TRY(
            const std::string codes,
            file.take(begin, file.bytes() - std::min<uint64_t>(begin, file.bytes()), "runs"));
        return check_runs(file, codes, begin, static_cast<uint32_t>(width),
                          static_cast<uint32_t>(height));
    }
    const uint64_t row_bytes = (uint64_t{bits} * static_cast<uint64_t>(width) + 31) / 32 * 4;
    if (begin + row_bytes * height > file.bytes())
        return fail(
            "{}: expected {} x {} pixels in bytes {} to {}, found the end of the file at "
            "byte {}",
            path.string(), width, height, begin, begin + row_bytes * height, file.bytes());
    return {};
}

Result<void> check_tiff(const std::filesystem::path& path) {
    PALPATE_TRY(Parts file, Parts::open(path));
    PALPATE_TRY(const std::string head, file.take(0, 8, "the header of a TIFF"));
    file.big_endian = head.starts_with("MM");
    const uint32_t version = file.number(head, 2, 2);
    if ((!file.big_endian && !head.starts_with("II")) || (version != 42 && version != 43))
        return fail("{}: expected a TIFF that begins with II or MM and 42, found other bytes",
                    path.string());
    if (version == 43)
        return {}; // BigTIFF: left to its library
    std::set<uint32_t> seen;
    for (uint32_t at = file.number(head, 4, 4); at != 0;) {
        if (!seen.insert(at).second)
            return fail("{}: expected pages one after another, found that of byte {} twice",
                        path.string(), at);
        Directory tags;
        PALPATE_TRY(const uint32_t next, read_directory(file, at, tags));
        PALPATE_TRY(check_page(file, tags));
        at = next;
    }
    if (seen.empty())
        return fail("{}: expected a page, found none", path.string());
    return {};
}

} // namespace palpate::io
