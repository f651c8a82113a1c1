#include "engine/decode/dicom_codestream.h"

#include <algorithm>
#include <fstream>

namespace palpate::io {

namespace {

using Bytes = std::span<const uint8_t>;

uint32_t big_16(Bytes bytes, size_t at) {
    return uint32_t{bytes[at]} << 8 | bytes[at + 1];
}
uint32_t big_32(Bytes bytes, size_t at) {
    return big_16(bytes, at) << 16 | big_16(bytes, at + 2);
}
uint32_t little_32(Bytes bytes, size_t at) {
    return uint32_t{bytes[at]} | uint32_t{bytes[at + 1]} << 8 | uint32_t{bytes[at + 2]} << 16 |
           uint32_t{bytes[at + 3]} << 24;
}

struct Expected {
    glm::uvec2 size;
    uint32_t bits; // allocated for a sample
};

// A sentence's end, such as "is cut off"; empty: no fault.
using Fault = std::string;

Fault check_frame_header(const char* codec, const Expected& expected, glm::uvec2 size,
                         uint32_t components, uint32_t bits) {
    if (size != expected.size)
        return fmt::format("holds a {} image of {} x {}, expected {} x {}", codec, size.x, size.y,
                           expected.size.x, expected.size.y);
    if (components != 1)
        return fmt::format("holds a {} image of {} components, expected 1", codec, components);
    if (bits == 0 || bits > expected.bits)
        return fmt::format("holds a {} image of {} bits a sample, expected at most {}", codec, bits,
                           expected.bits);
    return {};
}

// The byte after the entropy-coded data that starts at `at`: that of the next marker, or the end.
// A marker is 0xff and then 0x80 or more in JPEG-LS (T.87 C.2.1); in JPEG neither 0 nor a restart.
size_t after_scan(Bytes bytes, size_t at, bool jpeg_ls) {
    for (; at + 1 < bytes.size(); ++at) {
        if (bytes[at] != 0xff)
            continue;
        const uint8_t next = bytes[at + 1];
        const bool restart = next >= 0xd0 && next <= 0xd7;
        if (next == 0xff || restart || (jpeg_ls ? next < 0x80 : next == 0))
            continue;
        return at;
    }
    return bytes.size();
}

// Walks over one JPEG or JPEG-LS image that starts at `at` with SOI, and leaves `at` behind its
// end. ITU-T T.81 B.1, T.87 C.
Fault walk_jpeg(Bytes bytes, const Expected& expected, bool jpeg_ls, size_t& at) {
    const char* codec = jpeg_ls ? "JPEG-LS" : "JPEG";
    bool has_frame = false, has_scan = false;
    at += 2;
    for (;;) {
        if (at + 2 > bytes.size())
            return fmt::format("is cut off: its {} image has no end", codec);
        if (bytes[at] != 0xff)
            return fmt::format("holds a damaged {} image: no marker where one is due", codec);
        const uint8_t marker = bytes[at + 1];
        if (marker == 0xff) { // fill
            ++at;
            continue;
        }
        at += 2;
        if (marker == 0xd9)
            return has_scan ? Fault() : fmt::format("holds a {} image without samples", codec);
        if (marker == 0x01 || (marker >= 0xd0 && marker <= 0xd7))
            continue;
        const size_t length = at + 2 <= bytes.size() ? big_16(bytes, at) : 0;
        if (length < 2 || at + length > bytes.size())
            return fmt::format("is cut off: a segment of its {} image does not end", codec);
        const bool frame = (marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 &&
                            marker != 0xcc) ||
                           marker == 0xf7;
        if (frame) {
            if (length < 8 || has_frame || (marker == 0xf7) != jpeg_ls)
                return fmt::format("holds a damaged {} image: a wrong frame header", codec);
            has_frame = true;
            if (Fault fault = check_frame_header(codec, expected,
                                                 {big_16(bytes, at + 5), big_16(bytes, at + 3)},
                                                 bytes[at + 7], bytes[at + 2]);
                !fault.empty())
                return fault;
        }
        at += length;
        if (marker == 0xda) {
            if (!has_frame)
                return fmt::format("holds a damaged {} image: samples before its size", codec);
            has_scan = true;
            at = after_scan(bytes, at, jpeg_ls);
        }
    }
}

// Walks over one JPEG 2000 codestream, ITU-T T.800 Annex A.
Fault walk_jpeg_2000(Bytes bytes, const Expected& expected, size_t& at, uint32_t& signed_bits) {
    constexpr const char* kCodec = "JPEG 2000";
    const auto cut_off = [] { return std::string("is cut off: its JPEG 2000 image has no end"); };
    at += 2;
    bool has_size = false;
    for (;;) {
        if (at + 2 > bytes.size())
            return cut_off();
        const uint32_t marker = big_16(bytes, at);
        if (marker == 0xffd9) { // EOC
            at += 2;
            return has_size ? Fault() : "holds a JPEG 2000 image without size";
        }
        if (marker < 0xff00)
            return "holds a damaged JPEG 2000 image: no marker where one is due";
        if (at + 4 > bytes.size())
            return cut_off();
        const size_t length = big_16(bytes, at + 2);
        if (length < 2 || at + 2 + length > bytes.size())
            return cut_off();
        if (marker == 0xff51) { // SIZ: capabilities, size, offset, tile, its offset, components
            if (length < 41)
                return "holds a damaged JPEG 2000 image: a short size segment";
            has_size = true;
            const uint32_t precision = bytes[at + 40];
            const glm::uvec2 size(big_32(bytes, at + 6) - big_32(bytes, at + 14),
                                  big_32(bytes, at + 10) - big_32(bytes, at + 18));
            if (Fault fault = check_frame_header(kCodec, expected, size, big_16(bytes, at + 38),
                                                 (precision & 0x7f) + 1);
                !fault.empty())
                return fault;
            if (precision & 0x80)
                signed_bits = (precision & 0x7f) + 1;
        }
        if (marker == 0xff90) { // SOT: tile, length of the whole part from the marker on
            if (!has_size || length != 10)
                return "holds a damaged JPEG 2000 image: a wrong tile part";
            const size_t part = big_32(bytes, at + 6);
            if (part == 0) { // up to the end of the codestream
                const uint8_t end[] = {0xff, 0xd9};
                const auto found = std::find_end(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                                                 bytes.end(), std::begin(end), std::end(end));
                if (found == bytes.end())
                    return cut_off();
                at = static_cast<size_t>(found - bytes.begin());
                continue;
            }
            if (part < 14 || at + part > bytes.size())
                return cut_off();
            at += part;
            continue;
        }
        at += 2 + length;
    }
}

// RLE: 16 numbers ahead, how many segments there are and where each starts; PS3.5 G.5.
Fault check_rle(Bytes bytes, const Expected& expected) {
    if (bytes.size() < 64)
        return "is cut off: an RLE image without its table";
    const uint32_t segments = little_32(bytes, 0);
    if (segments != expected.bits / 8)
        return fmt::format("holds an RLE image of {} segments, expected {}", segments,
                           expected.bits / 8);
    for (uint32_t i = 0; i < segments; ++i) {
        const uint64_t start = little_32(bytes, 4 + 4 * i);
        const uint64_t end = i + 1 < segments ? little_32(bytes, 8 + 4 * i) : bytes.size();
        if (start < 64 || end < start || end > bytes.size())
            return "holds an RLE image whose table points outside it";
        // Each byte is a count: n + 1 bytes as they are, or one byte 257 - n times.
        uint64_t samples = 0;
        const uint64_t wanted = uint64_t{expected.size.x} * expected.size.y;
        for (uint64_t at = start; at < end && samples < wanted;) {
            const uint8_t count = bytes[at++];
            if (count < 128) {
                samples += count + 1u;
                at += count + 1u;
            } else if (count > 128) {
                samples += 257u - count;
                ++at;
            }
            if (at > end)
                return "is cut off: its RLE image ends within a run";
        }
        if (samples < wanted)
            return fmt::format("is cut off: an RLE segment holds {} of {} samples", samples,
                               wanted);
    }
    return {};
}

enum class Codec { rle, jpeg, jpeg_ls, jpeg_2000, other };

Codec codec_of(const std::string& syntax) {
    if (syntax == "1.2.840.10008.1.2.5")
        return Codec::rle;
    constexpr std::string_view kJpeg = "1.2.840.10008.1.2.4.";
    if (!syntax.starts_with(kJpeg))
        return Codec::other;
    const std::string number = syntax.substr(kJpeg.size());
    if (number == "80" || number == "81")
        return Codec::jpeg_ls;
    if (number == "90" || number == "91")
        return Codec::jpeg_2000;
    return number.size() == 2 && number >= "50" && number <= "70" ? Codec::jpeg : Codec::other;
}

Result<std::vector<uint8_t>> bytes_of(const DicomFile& file, const std::vector<EncodedItem>& items,
                                      size_t first, size_t last) {
    std::ifstream in(file.path, std::ios::binary);
    std::vector<uint8_t> bytes;
    for (size_t i = first; i < last; ++i) {
        const size_t before = bytes.size();
        bytes.resize(before + items[i].bytes);
        in.seekg(static_cast<std::streamoff>(items[i].at));
        if (!in.read(reinterpret_cast<char*>(&bytes[before]),
                     static_cast<std::streamsize>(items[i].bytes)))
            return fail("{}: cannot be read", file.path.string());
    }
    return bytes;
}

} // namespace

Result<std::vector<EncodedItem>> encoded_items(const DicomFile& file) {
    const std::string name = file.path.string();
    std::ifstream in(file.path, std::ios::binary);
    std::vector<EncodedItem> items;
    uint64_t at = file.pixels_at;
    for (;;) {
        uint8_t head[8];
        in.seekg(static_cast<std::streamoff>(at));
        if (!in.read(reinterpret_cast<char*>(head), sizeof head))
            return fail("{}: is cut off: its encoded pixels have no end within its {} bytes", name,
                        file.bytes);
        if (head[0] != 0xfe || head[1] != 0xff || head[3] != 0xe0)
            return fail("{}: its encoded pixels are damaged at byte {}", name, at);
        if (head[2] == 0xdd)
            return items;
        at += sizeof head;
        items.push_back({at, little_32(head, 4)});
        at += items.back().bytes;
        if (at > file.bytes)
            return fail("{}: is cut off: its encoded pixels have no end within its {} bytes", name,
                        file.bytes);
    }
}

Result<uint32_t> check_codestreams(const DicomFile& file) {
    const Codec codec = codec_of(file.syntax);
    if (!file.encapsulated || codec == Codec::other)
        return 0;
    const std::string name = file.path.string();
    PALPATE_TRY(const std::vector<EncodedItem> items, encoded_items(file));
    if (items.empty())
        return fail("{}: holds no encoded image", name);
    const Expected expected{file.mosaic.value_or(file.frames.front().size),
                            static_cast<uint32_t>(8 * bytes_per_component(file.type))};
    const size_t images = file.mosaic ? 1 : file.frames.size();
    if (codec == Codec::rle) { // an item is an image
        if (items.size() != images + 1)
            return fail("{}: holds {} RLE images, expected {}", name, items.size() - 1, images);
        for (size_t i = 1; i < items.size(); ++i) {
            PALPATE_TRY(const std::vector<uint8_t> bytes, bytes_of(file, items, i, i + 1));
            if (const Fault fault = check_rle(bytes, expected); !fault.empty())
                return fail("{}: {}", name, fault);
        }
        return 0;
    }
    PALPATE_TRY(const std::vector<uint8_t> bytes, bytes_of(file, items, 1, items.size()));
    const uint8_t start[] = {0xff, static_cast<uint8_t>(codec == Codec::jpeg_2000 ? 0x4f : 0xd8),
                             0xff};
    uint32_t signed_bits = 0;
    size_t found = 0;
    for (size_t at = 0;; ++found) { // padding may lie between images
        const auto next = std::search(bytes.begin() + static_cast<std::ptrdiff_t>(at), bytes.end(),
                                      std::begin(start), std::end(start));
        if (next == bytes.end())
            break;
        at = static_cast<size_t>(next - bytes.begin());
        const Fault fault = codec == Codec::jpeg_2000
                                ? walk_jpeg_2000(bytes, expected, at, signed_bits)
                                : walk_jpeg(bytes, expected, codec == Codec::jpeg_ls, at);
        if (!fault.empty())
            return fail("{}: {}", name, fault);
    }
    if (found != images)
        return fail("{}: holds {} encoded images, expected {}", name, found, images);
    return signed_bits;
}

} // namespace palpate::io
