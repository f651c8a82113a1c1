#include "engine/image/png.h"

#include <png.h>

#include <cmath>
#include <csetjmp>
#include <cstring>

#include "engine/base/file.h"
#include "engine/image/display_byte.h"

namespace palpate {

namespace {

constexpr uint64_t kDeflateRatio = 1032; // the most bytes that deflate makes of one (zlib.net)

// libpng reports errors by longjmp. Whatever runs under a setjmp below therefore holds nothing
// that wants destroying: memory is owned by the callers, outside of the jump.
struct PngState {
    png_structp png = nullptr;
    png_infop info = nullptr;
    bool writing = false;
    std::string_view input;
    size_t position = 0;
    std::vector<std::byte> output;
    char message[160] = "";

    explicit PngState(bool writes) : writing(writes) {
        png = writing ? png_create_write_struct(PNG_LIBPNG_VER_STRING, this, on_error, on_warning)
                      : png_create_read_struct(PNG_LIBPNG_VER_STRING, this, on_error, on_warning);
        info = png ? png_create_info_struct(png) : nullptr;
        if (!info)
            std::strcpy(message, "out of memory");
    }
    PngState(const PngState&) = delete;
    PngState& operator=(const PngState&) = delete;
    ~PngState() {
        if (writing)
            png_destroy_write_struct(&png, &info);
        else
            png_destroy_read_struct(&png, &info, nullptr);
    }

    [[noreturn]] static void on_error(png_structp png, png_const_charp text) {
        auto* state = static_cast<PngState*>(png_get_error_ptr(png));
        std::snprintf(state->message, sizeof state->message, "%s", text);
        png_longjmp(png, 1);
    }
    static void on_warning(png_structp, png_const_charp) {}

    static void on_read(png_structp png, png_bytep out, size_t count) {
        auto* state = static_cast<PngState*>(png_get_io_ptr(png));
        if (count > state->input.size() - state->position)
            png_error(png, "the file ends too early");
        std::memcpy(out, state->input.data() + state->position, count);
        state->position += count;
    }
    static void on_write(png_structp png, png_bytep bytes, size_t count) {
        auto* state = static_cast<PngState*>(png_get_io_ptr(png));
        if (!state->append(bytes, count))
            png_error(png, "out of memory");
    }
    static void on_flush(png_structp) {}

 private:
    bool append(png_bytep bytes, size_t count) noexcept try {
        const auto* first = reinterpret_cast<const std::byte*>(bytes);
        output.insert(output.end(), first, first + count);
        return true;
    } catch (const std::bad_alloc&) {
        return false;
    }
};

bool read_header(PngState& state) {
    if (setjmp(png_jmpbuf(state.png)))
        return false;
    png_set_read_fn(state.png, &state, PngState::on_read);
    png_set_user_limits(state.png, PNG_UINT_31_MAX, PNG_UINT_31_MAX); // ours has a better sentence
    png_read_info(state.png, state.info);
    return true;
}

// Allocates a few rows.
bool prepare_rows(PngState& state) {
    if (setjmp(png_jmpbuf(state.png)))
        return false;
    png_set_expand(state.png); // palettes and narrow grey to 8 bits, transparent colours to alpha
    png_set_interlace_handling(state.png);
    png_read_update_info(state.png, state.info);
    return true;
}

bool read_rows(PngState& state, png_bytepp rows) {
    if (setjmp(png_jmpbuf(state.png)))
        return false;
    png_read_image(state.png, rows);
    png_read_end(state.png, nullptr);
    return true;
}

bool write_picture(PngState& state, glm::uvec2 size_px, bool alpha, uint32_t dots_per_m,
                   png_bytepp rows) {
    if (setjmp(png_jmpbuf(state.png)))
        return false;
    png_set_write_fn(state.png, &state, PngState::on_write, PngState::on_flush);
    png_set_IHDR(state.png, state.info, size_px.x, size_px.y, 8,
                 alpha ? PNG_COLOR_TYPE_RGB_ALPHA : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    if (dots_per_m > 0)
        png_set_pHYs(state.png, state.info, dots_per_m, dots_per_m, PNG_RESOLUTION_METER);
    png_write_info(state.png, state.info);
    png_write_image(state.png, rows);
    png_write_end(state.png, nullptr);
    return true;
}

std::vector<png_bytep> rows_of(std::vector<png_byte>& bytes, size_t height) {
    std::vector<png_bytep> rows(height);
    for (size_t y = 0; y < height; ++y)
        rows[y] = bytes.data() + y * (bytes.size() / height);
    return rows;
}

std::vector<std::string> channels_of(png_byte count) {
    switch (count) {
        case 1:
            return {"Y"};
        case 2:
            return {"Y", "A"};
        case 3:
            return {"R", "G", "B"};
        default:
            return {"R", "G", "B", "A"};
    }
}

} // namespace

Result<void> save_png(const std::filesystem::path& path, const Image& image, double dots_per_inch) {
    PALPATE_TRY(const std::vector<std::byte> bytes,
                encode_png(path.string(), image, dots_per_inch));
    return save_bytes(path, bytes);
}

Result<std::vector<std::byte>> encode_png(const std::string& file_name, const Image& image,
                                          double dots_per_inch) {
    constexpr double kInches = 1000.0 / 25.4; // in a metre
    const double dots_per_m = std::round(dots_per_inch * kInches);
    if (!(dots_per_m >= 0.0 && dots_per_m <= 1e9))
        return fail("{}: expected 0 .. 1e7 dots an inch, found {:g}", file_name, dots_per_inch);
    std::vector<size_t> from;
    for (const char* name : {"R", "G", "B", "A"})
        if (const auto index = channel_index(image, name))
            from.push_back(*index);
        else if (*name != 'A')
            return fail("{}: a PNG holds the channels R, G and B, but the picture has no {}",
                        file_name, name);
    const auto [width, height] = std::pair(image.size_px.x, image.size_px.y);
    PALPATE_TRY(check_image_limits(file_name, width, height, from.size()));
    std::vector<png_byte> bytes;
    bytes.reserve(size_t{width} * height * from.size());
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x)
            for (const size_t channel : from)
                bytes.push_back(display_byte(image.at(x, y, channel)));
    std::vector<png_bytep> rows = rows_of(bytes, height);
    PngState state(/*writes=*/true);
    if (!state.info || !write_picture(state, image.size_px, from.size() == 4,
                                      static_cast<uint32_t>(dots_per_m), rows.data()))
        return fail("{}: cannot be written: {}", file_name, state.message);
    return std::move(state.output);
}

Result<Image> load_png(const std::filesystem::path& path) {
    PALPATE_TRY(const std::string bytes, load_text(path, 2 * kMaxImageBytes));
    PngState state(/*writes=*/false);
    state.input = bytes;
    if (!state.info || !read_header(state))
        return fail("{}: cannot be read as PNG: {}", path.string(), state.message);
    const uint32_t width = png_get_image_width(state.png, state.info);
    const uint32_t height = png_get_image_height(state.png, state.info);
    PALPATE_TRY(check_image_limits(path, width, height, 1));
    if (!prepare_rows(state))
        return fail("{}: cannot be read as PNG: {}", path.string(), state.message);
    const png_byte channels = png_get_channels(state.png, state.info);
    const bool wide = png_get_bit_depth(state.png, state.info) == 16;
    PALPATE_TRY(check_image_limits(path, width, height, channels));
    const uint64_t row_bytes = png_get_rowbytes(state.png, state.info);
    // Expanding a palette or 1-bit grey makes at most 32 times as much of what deflate holds.
    if (row_bytes * height / 32 > kDeflateRatio * bytes.size())
        return fail("{}: {} x {} pixels cannot be held in {} bytes", path.string(), width, height,
                    bytes.size());
    std::vector<png_byte> data(row_bytes * height);
    std::vector<png_bytep> rows = rows_of(data, height);
    if (!read_rows(state, rows.data()))
        return fail("{}: cannot be read as PNG: {}", path.string(), state.message);
    Image image = make_image({width, height}, channels_of(channels));
    for (size_t i = 0; i < image.samples.size(); ++i)
        image.samples[i] = wide ? static_cast<float>(data[2 * i] << 8 | data[2 * i + 1]) / 65535.0f
                                : static_cast<float>(data[i]) / 255.0f;
    return image;
}

} // namespace palpate
