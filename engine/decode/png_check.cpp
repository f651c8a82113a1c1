#include "engine/decode/picture_check.h"

#include <zlib.h>

#include <array>
#include <cctype>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/decode/forward_bytes.h"
#include "engine/decode/header_fields.h"

namespace palpate::io {

namespace {

// The unpacked bytes as IHDR tells of them.
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
    const uint64_t columns = number_of(header.substr(0, 4), true),
                   rows = number_of(header.substr(4, 4), true);
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
            PALPATE_TRY(look_at({out.data(), out.size() - stream_->avail_out}, name));
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

Result<Chunk> next_chunk(const std::string& name, ForwardBytes& bytes) {
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
    chunk.length = number_of(std::string_view(head).substr(0, 4), true);
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
Result<void> read_chunk(const std::string& name, const Chunk& chunk, ForwardBytes& bytes,
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
        PALPATE_TRY(visit(part));
        left -= part.size();
    }
    const std::string stored = bytes.take(4);
    if (stored.size() < 4)
        return fail("{}: ends at byte {}, within the checksum of the chunk {}: the file is cut off",
                    name, bytes.at(), chunk.kind);
    if (number_of(stored, true) != sum)
        return fail(
            "{}: the chunk {} at byte {} is damaged: its checksum is {:08x}, expected {:08x}", name,
            chunk.kind, chunk.at, number_of(stored, true), sum);
    return {};
}

} // namespace

Result<void> check_png(const std::filesystem::path& path) {
    const std::string name = path.string();
    PALPATE_TRY(ForwardBytes bytes, ForwardBytes::open(path));
    if (const std::string found = bytes.take(8); found != "\x89PNG\r\n\x1a\n")
        return fail("{}: expected the signature of PNG in its first 8 bytes, found \"{}\"", name,
                    shown(found));
    std::string header;
    std::unique_ptr<PngPixels> pixels;
    for (;;) {
        PALPATE_TRY(const Chunk chunk, next_chunk(name, bytes));
        const bool is_header = chunk.kind == "IHDR", is_data = chunk.kind == "IDAT";
        if (is_header != header.empty() || (is_header && chunk.length != 13))
            return fail(
                "{}: expected one chunk IHDR of 13 bytes, and that first, found {} of {} "
                "bytes at byte {}",
                name, chunk.kind, chunk.length, chunk.at);
        const bool is_critical = std::isupper(static_cast<unsigned char>(chunk.kind[0])) != 0;
        if (is_critical && !is_header && !is_data && chunk.kind != "PLTE" && chunk.kind != "IEND")
            return fail("{}: holds the critical chunk {} at byte {}, which is not known", name,
                        chunk.kind, chunk.at);
        Result<void> read = read_chunk(name, chunk, bytes, [&](auto part) -> Result<void> {
            if (is_header)
                header.append(reinterpret_cast<const char*>(part.data()), part.size());
            return is_data ? pixels->take(name, part) : Result<void>();
        });
        if (!read)
            return read;
        if (is_header) {
            PALPATE_TRY(PngRows rows, png_rows(name, header));
            pixels = std::make_unique<PngPixels>(std::move(rows));
        }
        if (chunk.kind == "IEND")
            return pixels->finish(name);
    }
}

} // namespace palpate::io
