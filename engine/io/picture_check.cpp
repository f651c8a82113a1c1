#include "engine/io/picture_check.h"

#include <zlib.h>

#include <array>
#include <cctype>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/io/byte_source.h"

namespace palpate::io {

namespace {

constexpr size_t kBlock = 1 << 16;

// A file read forward, byte by byte or in blocks, that knows where it is.
class Bytes {
 public:
    static Result<Bytes> open(const std::filesystem::path& path) {
        Result<ByteSource> source = ByteSource::open(path, Packing::none);
        if (!source)
            return pass_on(source);
        return Bytes(std::move(*source));
    }
    uint64_t at() const { return start_ + next_; }

    // -1 at the end of the file.
    int byte() {
        if (next_ == have_ && !refill())
            return -1;
        return static_cast<int>(block_[next_++]);
    }
    // Up to `most` bytes that lie one after another; empty at the end.
    std::span<const std::byte> some(uint64_t most) {
        if (next_ == have_ && !refill())
            return {};
        const size_t count = std::min<uint64_t>(most, have_ - next_);
        next_ += count;
        return std::span(block_).subspan(next_ - count, count);
    }
    // Fewer at the end of the file.
    std::string take(uint64_t count) {
        std::string out;
        while (out.size() < count) {
            const auto more = some(count - out.size());
            if (more.empty())
                break;
            out.append(reinterpret_cast<const char*>(more.data()), more.size());
        }
        return out;
    }

 private:
    explicit Bytes(ByteSource source) : source_(std::move(source)), block_(kBlock) {}

    bool refill() {
        start_ += have_;
        next_ = 0;
        const Result<size_t> got = source_.read(block_);
        have_ = got ? *got : 0; // what cannot be read ends there
        return have_ > 0;
    }
    ByteSource source_;
    std::vector<std::byte> block_;
    uint64_t start_ = 0; // of the block, in the file
    size_t next_ = 0, have_ = 0;
};

uint32_t big(std::string_view bytes) {
    uint32_t value = 0;
    for (const char c : bytes)
        value = value << 8 | static_cast<unsigned char>(c);
    return value;
}

// "IDAT" or bytes.
std::string shown(std::string_view bytes) {
    std::string text;
    for (const char c : bytes)
        text += std::isalpha(static_cast<unsigned char>(c))
                    ? std::string(1, c)
                    : fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    return text;
}

// What IHDR says about the unpacked bytes.
struct PngRows {
    struct Pass {
        uint64_t rows, row_bytes; // row_bytes counts the filter byte
    };
    std::vector<Pass> passes;

    uint64_t bytes() const {
        uint64_t total = 0;
        for (const Pass& pass : passes)
            total += pass.rows * pass.row_bytes;
        return total;
    }
};

Result<PngRows> png_rows(const std::string& name, std::string_view header) {
    const uint64_t columns = big(header.substr(0, 4)), rows = big(header.substr(4, 4));
    const int depth = header[8], color = header[9], interlace = header[12];
    if (columns < 1 || rows < 1 || columns >= uint64_t{1} << 31 || rows >= uint64_t{1} << 31)
        return fail("{}: expected 1 to 2147483647 columns and rows, found {} x {}", name, columns,
                    rows);
    const int samples = color == 2 ? 3 : color == 4 ? 2 : color == 6 ? 4 : 1;
    const bool any_depth = depth == 1 || depth == 2 || depth == 4 || depth == 8 || depth == 16;
    const bool fits = color == 0   ? any_depth
                      : color == 3 ? any_depth && depth != 16
                                   : depth == 8 || depth == 16;
    if (!fits || (color != 0 && color != 2 && color != 3 && color != 4 && color != 6))
        return fail("{}: expected a bit depth and colour type of PNG, found {} and {}", name, depth,
                    color);
    if (header[10] != 0 || header[11] != 0 || interlace < 0 || interlace > 1)
        return fail(
            "{}: expected compression 0, filter method 0 and interlace 0 or 1, found {}, {} and {}",
            name, int{header[10]}, int{header[11]}, interlace);
    PngRows result;
    const auto add = [&](uint64_t width, uint64_t height) {
        if (width > 0 && height > 0)
            result.passes.push_back(
                {height, 1 + (width * static_cast<uint64_t>(samples * depth) + 7) / 8});
    };
    if (interlace == 0) {
        add(columns, rows);
        return result;
    }
    // Adam7: every pass begins at (x, y) and takes each dx-th, dy-th pixel.
    constexpr std::array<std::array<uint64_t, 4>, 7> passes{{{0, 0, 8, 8},
                                                             {4, 0, 8, 8},
                                                             {0, 4, 4, 8},
                                                             {2, 0, 4, 4},
                                                             {0, 2, 2, 4},
                                                             {1, 0, 2, 2},
                                                             {0, 1, 1, 2}}};
    for (const auto& [x, y, dx, dy] : passes)
        add(columns > x ? (columns - x + dx - 1) / dx : 0, rows > y ? (rows - y + dy - 1) / dy : 0);
    return result;
}

// Unpacks the data of IDAT chunks as they come, and counts rows.
class PngPixels {
 public:
    explicit PngPixels(PngRows rows) : rows_(std::move(rows)), stream_(new z_stream{}) {
        inflateInit(stream_.get());
    }

    Result<void> take(const std::string& name, std::span<const std::byte> packed) {
        stream_->next_in =
            const_cast<Bytef*>(reinterpret_cast<const Bytef*>(packed.data())); // zlib only reads
        stream_->avail_in = static_cast<uInt>(packed.size());
        std::array<Bytef, 1 << 15> out;
        while (stream_->avail_in > 0 && !ended_) {
            stream_->next_out = out.data();
            stream_->avail_out = out.size();
            const int status = inflate(stream_.get(), Z_NO_FLUSH);
            if (status != Z_OK && status != Z_STREAM_END && status != Z_BUF_ERROR)
                return fail("{}: the compressed pixels are damaged after {} of {} bytes: {}", name,
                            done_, rows_.bytes(),
                            stream_->msg ? stream_->msg : "they make no sense");
            ended_ = status == Z_STREAM_END;
            if (Result<void> rows = look_at({out.data(), out.size() - stream_->avail_out}, name);
                !rows)
                return rows;
        }
        return {};
    }
    Result<void> finish(const std::string& name) const {
        if (done_ < rows_.bytes())
            return fail("{}: expected {} bytes of unpacked pixels, as its size claims, found {}",
                        name, rows_.bytes(), done_);
        if (!ended_)
            return fail("{}: the compressed pixels do not end: their checksum is missing", name);
        return {};
    }

 private:
    struct End {
        void operator()(z_stream* stream) const {
            inflateEnd(stream);
            delete stream;
        }
    };

    // Each row begins with the number of its filter.
    Result<void> look_at(std::span<const Bytef> bytes, const std::string& name) {
        size_t at = 0;
        while (at < bytes.size() && pass_ < rows_.passes.size()) {
            const PngRows::Pass& pass = rows_.passes[pass_];
            if (in_row_ == 0 && bytes[at] > 4)
                return fail("{}: expected a filter 0 to 4 in row {}, found {}", name, row_,
                            bytes[at]);
            const uint64_t step = std::min<uint64_t>(bytes.size() - at, pass.row_bytes - in_row_);
            at += step;
            done_ += step;
            in_row_ += step;
            if (in_row_ < pass.row_bytes)
                break;
            in_row_ = 0;
            if (++row_ == pass.rows) {
                row_ = 0;
                ++pass_;
            }
        }
        return {};
    }

    PngRows rows_;
    std::unique_ptr<z_stream, End> stream_;
    bool ended_ = false;
    uint64_t done_ = 0; // bytes of rows
    size_t pass_ = 0;
    uint64_t row_ = 0, in_row_ = 0;
};

struct Chunk {
    uint64_t at; // of its length
    uint32_t length;
    std::string kind;
};

Result<Chunk> next_chunk(const std::string& name, Bytes& bytes) {
    Chunk chunk{bytes.at(), 0, {}};
    const std::string head = bytes.take(8);
    if (head.empty())
        return fail("{}: ends at byte {} without the chunk IEND: the file is cut off", name,
                    chunk.at);
    if (head.size() < 8)
        return fail(
            "{}: ends at byte {}, within a chunk that begins at byte {}: the file is cut "
            "off",
            name, bytes.at(), chunk.at);
    chunk.length = big(std::string_view(head).substr(0, 4));
    chunk.kind = head.substr(4);
    for (const char c : chunk.kind)
        if (!std::isalpha(static_cast<unsigned char>(c)))
            return fail("{}: expected a chunk of four letters at byte {}, found \"{}\"", name,
                        chunk.at, shown(chunk.kind));
    if (chunk.length >= uint32_t{1} << 31)
        return fail("{}: expected at most 2147483647 bytes in the chunk {} at byte {}, found {}",
                    name, chunk.kind, chunk.at, chunk.length);
    return chunk;
}

// Passes over the data of a chunk and its checksum; visit(part) sees the data.
template <class Visit>
Result<void> read_chunk(const std::string& name, const Chunk& chunk, Bytes& bytes,
                        const Visit& visit) {
    uLong sum = ::crc32(0, reinterpret_cast<const Bytef*>(chunk.kind.data()), 4);
    for (uint64_t left = chunk.length; left > 0;) {
        const auto part = bytes.some(left);
        if (part.empty())
            return fail(
                "{}: ends at byte {}, within the chunk {} of {} bytes that begins at byte "
                "{}: the file is cut off",
                name, bytes.at(), chunk.kind, chunk.length, chunk.at);
        sum = ::crc32(sum, reinterpret_cast<const Bytef*>(part.data()),
                      static_cast<uInt>(part.size()));
        if (Result<void> visited = visit(part); !visited)
            return visited;
        left -= part.size();
    }
    const std::string stored = bytes.take(4);
    if (stored.size() < 4)
        return fail("{}: ends at byte {}, within the checksum of the chunk {}: the file is cut off",
                    name, bytes.at(), chunk.kind);
    if (big(stored) != sum)
        return fail(
            "{}: the chunk {} at byte {} is damaged: its checksum is {:08x}, expected {:08x}", name,
            chunk.kind, chunk.at, big(stored), sum);
    return {};
}

} // namespace

Result<void> check_png(const std::filesystem::path& path) {
    const std::string name = path.string();
    Result<Bytes> bytes = Bytes::open(path);
    if (!bytes)
        return pass_on(bytes);
    if (const std::string found = bytes->take(8); found != "\x89PNG\r\n\x1a\n")
        return fail("{}: expected the signature of PNG in its first 8 bytes, found \"{}\"", name,
                    shown(found));
    std::string header;
    std::unique_ptr<PngPixels> pixels;
    for (;;) {
        const Result<Chunk> chunk = next_chunk(name, *bytes);
        if (!chunk)
            return fail("{}", chunk.error().message);
        const bool is_header = chunk->kind == "IHDR", is_data = chunk->kind == "IDAT";
        if (is_header != header.empty() || (is_header && chunk->length != 13))
            return fail(
                "{}: expected one chunk IHDR of 13 bytes, and that first, found {} of {} "
                "bytes at byte {}",
                name, chunk->kind, chunk->length, chunk->at);
        const bool is_critical = std::isupper(static_cast<unsigned char>(chunk->kind[0])) != 0;
        if (is_critical && !is_header && !is_data && chunk->kind != "PLTE" && chunk->kind != "IEND")
            return fail("{}: holds the critical chunk {} at byte {}, which is not known", name,
                        chunk->kind, chunk->at);
        Result<void> read = read_chunk(name, *chunk, *bytes, [&](auto part) -> Result<void> {
            if (is_header)
                header.append(reinterpret_cast<const char*>(part.data()), part.size());
            return is_data ? pixels->take(name, part) : Result<void>();
        });
        if (!read)
            return read;
        if (is_header) {
            Result<PngRows> rows = png_rows(name, header);
            if (!rows)
                return pass_on(rows);
            pixels = std::make_unique<PngPixels>(std::move(*rows));
        }
        if (chunk->kind == "IEND")
            return pixels->finish(name);
    }
}

namespace {

bool is_frame(int marker) { // SOF0 .. SOF15 but DHT, JPG and DAC
    return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}

// Passes over the bits of a scan; the marker that ends them, or -1 at the end of the file.
int skip_scan(Bytes& bytes) {
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
    const uint32_t rows = big(data.substr(1, 2)), columns = big(data.substr(3, 2));
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
    Result<Bytes> bytes = Bytes::open(path);
    if (!bytes)
        return pass_on(bytes);
    if (const std::string found = bytes->take(2); found != "\xff\xd8")
        return fail("{}: expected the marker SOI of JPEG in its first 2 bytes, found \"{}\"", name,
                    shown(found));
    bool has_frame = false, has_scan = false;
    int marker = -1; // met already, at the end of a scan
    for (;;) {
        const uint64_t at = bytes->at() - (marker >= 0 ? 2 : 0);
        if (marker < 0) {
            const int begin = bytes->byte();
            if (begin >= 0 && begin != 0xff)
                return fail("{}: expected a marker at byte {}, found the byte {:#04x}", name, at,
                            begin);
            do
                marker = begin < 0 ? -1 : bytes->byte();
            while (marker == 0xff);
        }
        if (marker < 0)
            return fail("{}: ends at byte {} without the marker EOI: the file is cut off", name,
                        bytes->at());
        if (marker == 0xd9) // EOI
            break;
        if (marker == 0x01 || (marker >= 0xd0 && marker <= 0xd7)) { // TEM, RST: no segment
            marker = -1;
            continue;
        }
        if (marker == 0x00 || marker == 0xd8 || (marker >= 0x02 && marker <= 0xbf))
            return fail("{}: expected a segment of JPEG at byte {}, found the marker {:#04x}", name,
                        at, marker);
        const std::string length = bytes->take(2);
        const uint32_t segment = length.size() == 2 ? big(length) : 2;
        if (segment < 2)
            return fail(
                "{}: expected a length of 2 or more in the segment {:#04x} at byte {}, found "
                "{}",
                name, marker, at, segment);
        const std::string data = bytes->take(segment - 2);
        if (length.size() < 2 || data.size() < segment - 2)
            return fail(
                "{}: ends at byte {}, within the segment {:#04x} of {} bytes that begins at "
                "byte {}: the file is cut off",
                name, bytes->at(), marker, segment, at);
        if (is_frame(marker)) {
            if (has_frame)
                return fail("{}: expected one frame, found a second at byte {}", name, at);
            if (Result<void> frame = check_frame(name, marker, at, data); !frame)
                return frame;
            has_frame = true;
        }
        const bool is_scan = marker == 0xda;
        if (is_scan && !has_frame)
            return fail("{}: expected a frame before the scan at byte {}, found none", name, at);
        has_scan = has_scan || is_scan;
        marker = is_scan ? skip_scan(*bytes) : -1;
        if (is_scan && marker < 0)
            return fail(
                "{}: ends at byte {}, within the scan that begins at byte {}, without the "
                "marker EOI: the file is cut off",
                name, bytes->at(), at);
    }
    if (!has_scan)
        return fail("{}: ends without a scan: it holds no pixels", name);
    return {};
}

} // namespace palpate::io
