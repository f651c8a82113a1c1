#include <string>
#include <string_view>

#include "engine/decode/forward_bytes.h"
#include "engine/decode/header_fields.h"
#include "engine/decode/picture_check.h"

namespace palpate::io {

namespace {

bool is_frame(int marker) { // SOF0 .. SOF15 but DHT, JPG and DAC
    return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}

// Passes over the bits of a scan; the marker that ends them, or -1 at the end of the file.
int skip_scan(ForwardBytes& bytes) {
    for (int byte = bytes.byte(); byte >= 0; byte = bytes.byte()) {
        if (byte != 0xff)
            continue;
        do
            byte = bytes.byte();
        while (byte == 0xff);                                                // fill bytes
        const bool is_data = byte == 0x00 || (byte >= 0xd0 && byte <= 0xd7); // or a restart
        if (!is_data)
            return byte;
    }
    return -1;
}

Result<void> check_frame(const std::string& name, int marker, uint64_t at, std::string_view data) {
    if (marker != 0xc0 && marker != 0xc1 && marker != 0xc2)
        return fail(
            "{}: is a JPEG of process SOF{} ({}), expected baseline, extended or progressive "
            "Huffman coding (SOF0 to SOF2)",
            name, marker - 0xc0,
            marker == 0xc3   ? "lossless"
            : marker >= 0xc9 ? "arithmetic coding"
                             : "differential");
    if (data.size() < 6)
        return fail("{}: expected a frame header of 6 bytes or more at byte {}, found {}", name, at,
                    data.size());
    const int precision = static_cast<unsigned char>(data[0]);
    const uint32_t rows = number_of(data.substr(1, 2), true),
                   columns = number_of(data.substr(3, 2), true);
    const size_t components = static_cast<unsigned char>(data[5]);
    if (precision != 8)
        return fail("{}: expected samples of 8 bits, found {}", name, precision);
    if (rows < 1 || columns < 1)
        return fail("{}: expected 1 to 65535 columns and rows, found {} x {}", name, columns, rows);
    if (components < 1 || components > 4 || data.size() != 6 + 3 * components)
        return fail(
            "{}: expected 1 to 4 components of 3 bytes each in the frame at byte {}, found "
            "{} in {} bytes",
            name, at, components, data.size() - 6);
    for (size_t i = 0; i < components; ++i) {
        const int sampling = static_cast<unsigned char>(data[7 + 3 * i]);
        if ((sampling >> 4) < 1 || (sampling >> 4) > 4 || (sampling & 15) < 1 ||
            (sampling & 15) > 4)
            return fail(
                "{}: expected sampling factors 1 to 4 in the frame at byte {}, found {} x {}", name,
                at, sampling >> 4, sampling & 15);
    }
    return {};
}

} // namespace

Result<void> check_jpeg(const std::filesystem::path& path) {
    const std::string name = path.string();
    PALPATE_TRY(ForwardBytes bytes, ForwardBytes::open(path));
    if (const std::string found = bytes.take(2); found != "\xff\xd8")
        return fail("{}: expected the marker SOI of JPEG in its first 2 bytes, found \"{}\"", name,
                    shown(found));
    bool has_frame = false, has_scan = false;
    int marker = -1; // met already, at the end of a scan
    for (;;) {
        const uint64_t at = bytes.at() - (marker >= 0 ? 2 : 0);
        if (marker < 0) {
            const int begin = bytes.byte();
            if (begin >= 0 && begin != 0xff)
                return fail("{}: expected a marker at byte {}, found the byte {:#04x}", name, at,
                            begin);
            do
                marker = begin < 0 ? -1 : bytes.byte();
            while (marker == 0xff);
        }
        if (marker < 0)
            return fail("{}: ends at byte {} without the marker EOI: the file is cut off", name,
                        bytes.at());
        if (marker == 0xd9) // EOI
            break;
        if (marker == 0x01 || (marker >= 0xd0 && marker <= 0xd7)) { // TEM, RST: no segment
            marker = -1;
            continue;
        }
        if (marker == 0x00 || marker == 0xd8 || (marker >= 0x02 && marker <= 0xbf))
            return fail("{}: expected a segment of JPEG at byte {}, found the marker {:#04x}", name,
                        at, marker);
        const std::string length = bytes.take(2);
        const uint32_t segment = length.size() == 2 ? number_of(length, true) : 2;
        if (segment < 2)
            return fail(
                "{}: expected a length of 2 or more in the segment {:#04x} at byte {}, found "
                "{}",
                name, marker, at, segment);
        const std::string data = bytes.take(segment - 2);
        if (length.size() < 2 || data.size() < segment - 2)
            return fail(
                "{}: ends at byte {}, within the segment {:#04x} of {} bytes that begins at "
                "byte {}: the file is cut off",
                name, bytes.at(), marker, segment, at);
        if (is_frame(marker)) {
            if (has_frame)
                return fail("{}: expected one frame, found a second at byte {}", name, at);
            PALPATE_TRY(check_frame(name, marker, at, data));
            has_frame = true;
        }
        const bool is_scan = marker == 0xda;
        if (is_scan && !has_frame)
            return fail("{}: expected a frame before the scan at byte {}, found none", name, at);
        has_scan = has_scan || is_scan;
        marker = is_scan ? skip_scan(bytes) : -1;
        if (is_scan && marker < 0)
            return fail(
                "{}: ends at byte {}, within the scan that begins at byte {}, without the "
                "marker EOI: the file is cut off",
                name, bytes.at(), at);
    }
    if (!has_scan)
        return fail("{}: ends without a scan: it holds no pixels", name);
    return {};
}

} // namespace palpate::io
