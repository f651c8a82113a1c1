#include "engine/image/exr_header.h"

#include <array>
#include <cstdint>
#include <optional>

#include "engine/image/image.h"

namespace palpate {

namespace {

constexpr uint32_t kMagic = 20000630;
constexpr uint32_t kFormatVersion = 2;
constexpr uint32_t kTiled = 0x200, kDeep = 0x800, kMultiPart = 0x1000;

// Reads little-endian numbers and zero-ended names; nothing once the bytes have run out.
class Walker {
 public:
    explicit Walker(std::string_view bytes) : bytes_(bytes) {}

    size_t rest() const { return bytes_.size(); }

    std::optional<uint32_t> number() {
        if (bytes_.size() < 4)
            return std::nullopt;
        uint32_t value = 0;
        for (size_t i = 0; i < 4; ++i)
            value |= uint32_t{static_cast<uint8_t>(bytes_[i])} << (8 * i);
        bytes_.remove_prefix(4);
        return value;
    }
    std::optional<std::string_view> name() {
        const size_t end = bytes_.find('\0');
        if (end == std::string_view::npos)
            return std::nullopt;
        const std::string_view text = bytes_.substr(0, end);
        bytes_.remove_prefix(end + 1);
        return text;
    }
    std::string_view take(size_t count) {
        const std::string_view taken = bytes_.substr(0, count);
        bytes_.remove_prefix(taken.size());
        return taken;
    }

 private:
    std::string_view bytes_;
};

// A channel list: name, then type, linearity and two subsampling factors in 16 bytes; an empty
// name ends it.
uint64_t count_channels(std::string_view value) {
    Walker walker(value);
    uint64_t count = 0;
    while (const auto name = walker.name()) {
        if (name->empty() || walker.take(16).size() < 16)
            break;
        ++count;
    }
    return count;
}

// Rows compressed together, by the number in the attribute "compression".
uint64_t rows_per_chunk(uint8_t compression) {
    switch (compression) {
        case 3: // ZIP
        case 5: // PXR24
            return 16;
        case 4: // PIZ
        case 6: // B44
        case 7: // B44A
        case 8: // DWAA
            return 32;
        case 9: // DWAB
            return 256;
        default: // none, RLE, ZIPS
            return 1;
    }
}

} // namespace

Result<void> check_exr_header(const std::filesystem::path& path, std::string_view bytes) {
    Walker walker(bytes);
    const auto magic = walker.number();
    const auto version = walker.number();
    if (!magic || *magic != kMagic || !version)
        return fail("{}: expected an OpenEXR file, found other content", path.string());
    if ((*version & 0xff) != kFormatVersion)
        return fail("{}: expected OpenEXR format {}, found {}", path.string(), kFormatVersion,
                    *version & 0xff);
    if (*version & (kTiled | kDeep | kMultiPart))
        return fail("{}: expected one flat scanline picture, found a {} OpenEXR file",
                    path.string(),
                    *version & kMultiPart ? "multi-part"
                    : *version & kDeep    ? "deep"
                                          : "tiled");
    uint64_t channels = 0, rows_together = 1;
    std::optional<std::array<int32_t, 4>> window; // left, top, right, bottom, all inclusive
    while (true) {
        const auto name = walker.name();
        if (name && name->empty())
            break;
        const auto type = name ? walker.name() : std::nullopt;
        const auto size = type ? walker.number() : std::nullopt;
        if (!size || *size > walker.rest())
            return fail(
                "{}: expected a whole OpenEXR header, found the end of the file after {} "
                "bytes",
                path.string(), bytes.size());
        const std::string_view value = walker.take(*size);
        if (*name == "channels")
            channels += count_channels(value);
        if (*name == "compression" && !value.empty())
            rows_together = rows_per_chunk(static_cast<uint8_t>(value[0]));
        if (*name == "dataWindow" && value.size() == 16) {
            Walker numbers(value);
            window.emplace();
            for (int32_t& side : *window)
                side = static_cast<int32_t>(*numbers.number());
        }
    }
    if (!window || (*window)[2] < (*window)[0] || (*window)[3] < (*window)[1])
        return fail("{}: expected a data window of at least one pixel, found none", path.string());
    const uint64_t width = static_cast<uint64_t>(int64_t{(*window)[2]} - (*window)[0] + 1);
    const uint64_t height = static_cast<uint64_t>(int64_t{(*window)[3]} - (*window)[1] + 1);
    const uint64_t chunks = (height + rows_together - 1) / rows_together;
    PALPATE_TRY(check_image_limits(path, width, height, channels));
    PALPATE_TRY(check_image_limits(path, width, chunks * rows_together, channels));
    // Each chunk has an offset of 8 bytes in the table, and its row and length, 8 bytes more.
    if (walker.rest() < 16 * chunks)
        return fail("{}: expected at least {} bytes after the header for {} rows, found {}",
                    path.string(), 16 * chunks, height, walker.rest());
    return {};
}

} // namespace palpate
