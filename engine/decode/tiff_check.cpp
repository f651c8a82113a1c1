#include <algorithm>
#include <cstdlib>
#include <set>
#include <string>

#include "engine/decode/picture_check.h"
#include "engine/decode/tiff_file.h"
#include "engine/io/decoder.h"

namespace palpate::io {

namespace {

// ---- BMP ----

// Run-length codes: pairs of bytes up to the end mark, of runs that lie within the picture.
Result<void> check_runs(const FileParts& file, std::string_view codes, uint64_t begin,
                        uint32_t width, uint32_t height) {
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

// The strips or tiles of one page lie in the file.
Result<void> check_page(TiffFile& file, const TiffDirectory& page) {
    for (const auto& [tag, what] : {std::pair(256, "its width"), {257, "its height"}}) {
        PALPATE_TRY(const std::vector<uint64_t> side,
                    file.numbers(page, static_cast<uint32_t>(tag), what));
        if (side.size() != 1 || side.front() == 0)
            return fail("{}: expected one number above 0 as {} (tag {}), found {}", file.name(),
                        what, tag, side.empty() ? "none" : std::to_string(side.front()));
    }
    const bool tiled = page.tags.contains(324);
    PALPATE_TRY(const std::vector<uint64_t> at,
                file.numbers(page, tiled ? 324 : 273, "the places of its pixels"));
    PALPATE_TRY(const std::vector<uint64_t> bytes,
                file.numbers(page, tiled ? 325 : 279, "the sizes of its pixels"));
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
    PALPATE_TRY(FileParts file, FileParts::open(path));
    PALPATE_TRY(const std::string head, file.take(0, 54, "the header of a BMP"));
    if (!head.starts_with("BM"))
        return fail("{}: expected a BMP that begins with BM, found other bytes", path.string());
    const uint64_t begin = file.number(head, 10, 4), size = file.number(head, 14, 4);
    const auto width = static_cast<int32_t>(file.number(head, 18, 4));
    const auto rows = static_cast<int32_t>(file.number(head, 22, 4));
    const uint64_t bits = file.number(head, 28, 2), packing = file.number(head, 30, 4);
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
    PALPATE_TRY(TiffFile file, TiffFile::open(path));
    if (file.is_big_tiff())
        return {}; // left to its library
    std::set<uint64_t> seen;
    for (uint64_t at = file.first_directory(); at != 0;) {
        if (!seen.insert(at).second)
            return fail("{}: expected pages one after another, found that of byte {} twice",
                        path.string(), at);
        PALPATE_TRY(const TiffDirectory page, file.directory(at));
        PALPATE_TRY(check_page(file, page));
        at = page.next;
    }
    if (seen.empty())
        return fail("{}: expected a page, found none", path.string());
    return {};
}

} // namespace palpate::io
