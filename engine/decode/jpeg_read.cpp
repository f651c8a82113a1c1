#include "engine/decode/jpeg_read.h"

#include <csetjmp>
#include <cstdio>

#include <jpeglib.h> // needs cstdio before it

#include <jerror.h>

namespace palpate::io {

namespace {

struct ErrorState {
    jpeg_error_mgr manager; // first: libjpeg knows only this part
    jmp_buf back;
    char message[JMSG_LENGTH_MAX];
};

[[noreturn]] void stop(j_common_ptr info) {
    auto* const state = reinterpret_cast<ErrorState*>(info->err);
    info->err->format_message(info, state->message);
    std::longjmp(state->back, 1);
}

// Called with a level below 0 of damage that libjpeg would pass over, and above 0 of a trace.
// Bytes between segments lose nothing.
void judge(j_common_ptr info, int level) {
    if (level < 0 && info->err->msg_code != JWRN_EXTRANEOUS_DATA)
        stop(info);
}

// Opens, reads the header, and calls then(decompressor); the result of it, or libjpeg's message in
// `state`. Nothing with a destructor lives between setjmp and longjmp.
template <class Then>
bool decompress(std::FILE* file, ErrorState& state, const Then& then) {
    jpeg_decompress_struct info{};
    info.err = jpeg_std_error(&state.manager);
    state.manager.error_exit = stop;
    state.manager.emit_message = judge;
    if (setjmp(state.back) != 0) {
        jpeg_destroy_decompress(&info);
        return false;
    }
    jpeg_create_decompress(&info);
    jpeg_stdio_src(&info, file);
    jpeg_read_header(&info, TRUE);
    info.out_color_space = info.jpeg_color_space == JCS_GRAYSCALE ? JCS_GRAYSCALE : JCS_RGB;
    then(info);
    jpeg_destroy_decompress(&info);
    return true;
}

template <class Then>
Result<void> with_file(const std::filesystem::path& path, const Then& then) {
    std::FILE* const file = std::fopen(path.c_str(), "rb");
    if (!file)
        return fail("{}: cannot be read", path.string());
    ErrorState state{};
    const bool done = decompress(file, state, then);
    std::fclose(file);
    if (!done)
        return fail("{}: cannot be read as JPEG: {}", path.string(), state.message);
    return {};
}

} // namespace

Result<PictureHeader> read_jpeg_header(const std::filesystem::path& path) {
    PictureHeader header;
    Result<void> read = with_file(path, [&](jpeg_decompress_struct& info) {
        header.size = {info.image_width, info.image_height, 1};
        header.type = ComponentType::u8;
        header.components = info.jpeg_color_space == JCS_GRAYSCALE ? 1
                            : info.num_components == 4             ? 4
                                                                   : 3;
    });
    if (!read)
        return pass_on(read);
    if (header.components == 4)
        return fail("{}: holds four colours (CMYK); expected grey or RGB", path.string());
    return header;
}

Result<void> read_jpeg(const std::filesystem::path& path, std::span<std::byte> pixels) {
    bool same_size = false;
    Result<void> read = with_file(path, [&](jpeg_decompress_struct& info) {
        jpeg_start_decompress(&info);
        const size_t row_bytes = size_t{info.output_width} * info.output_components;
        same_size = row_bytes * info.output_height == pixels.size();
        while (same_size && info.output_scanline < info.output_height) {
            auto* row =
                reinterpret_cast<JSAMPROW>(pixels.data() + row_bytes * info.output_scanline);
            jpeg_read_scanlines(&info, &row, 1);
        }
        if (same_size)
            jpeg_finish_decompress(&info);
    });
    if (read && !same_size)
        return fail("{}: its size changed while it was read", path.string());
    return read;
}

} // namespace palpate::io
