#include "engine/net/net_array.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "engine/base/printable.h"
#include "engine/net/blosc_chunk.h"
#include "engine/net/bytes.h"
#include "engine/volume/box.h"

namespace palpate {

namespace {

constexpr std::string_view kMagic = "NNIA";
constexpr uint8_t kArrayVersion = 1, kZstdCodec = 1;

// Takes numbers from the front of what is left.
class Reader {
 public:
    explicit Reader(std::span<const std::byte> bytes) : left_(bytes) {}

    size_t size() const { return left_.size(); }

    Result<std::span<const std::byte>> take(uint64_t count) {
        if (count > left_.size())
            return fail("expected {} more bytes of an array, found {}", count, left_.size());
        const auto taken = left_.first(size_t(count));
        left_ = left_.subspan(size_t(count));
        return taken;
    }
    template <class T>
    Result<T> number() {
        PALPATE_TRY(const std::span<const std::byte> bytes, take(sizeof(T)));
        return number_at<T>(bytes, 0);
    }

 private:
    std::span<const std::byte> left_;
};

Result<void> expect_header(Reader& reader, std::span<const int64_t> shape) {
    PALPATE_TRY(const std::span<const std::byte> fixed, reader.take(8));
    if (text_of(fixed.first(4)) != kMagic)
        return fail("expected an array that begins with {}, found {}", kMagic,
                    printable(text_of(fixed.first(4))));
    const auto byte = [&](size_t at) { return std::to_integer<uint8_t>(fixed[at]); };
    if (byte(4) != kArrayVersion || byte(5) != kZstdCodec)
        return fail(
            "expected an array of version {} compressed by zstd (codec {}), found version "
            "{} and codec {}",
            kArrayVersion, kZstdCodec, byte(4), byte(5));
    PALPATE_TRY(const std::span<const std::byte> name, reader.take(byte(7)));
    const std::string_view type = text_of(name);
    if (type != "uint8" && type != "int8" && type != "bool")
        return fail("expected an array of uint8, int8 or bool, found {}", printable(type));
    std::vector<int64_t> found(byte(6));
    for (int64_t& size : found) {
        PALPATE_TRY(size, reader.number<int64_t>());
    }
    if (!std::ranges::equal(found, shape))
        return fail("expected an array of {}, found {}", fmt::join(shape, " x "),
                    fmt::join(found, " x "));
    return {};
}

std::vector<std::byte> write_array(std::span<const std::byte> elements, std::string_view type,
                                   size_t element_bytes, std::span<const int64_t> shape) {
    std::vector<std::byte> wire;
    const auto append = [&](std::span<const std::byte> bytes) {
        wire.insert(wire.end(), bytes.begin(), bytes.end());
    };
    append(bytes_of(kMagic));
    for (const size_t byte : {size_t{kArrayVersion}, size_t{kZstdCodec}, shape.size(), type.size()})
        wire.push_back(std::byte(uint8_t(byte)));
    append(bytes_of(type));
    for (const int64_t size : shape)
        append_number(wire, size);
    const size_t chunks = (elements.size() + kLargestBloscChunk - 1) / kLargestBloscChunk;
    append_number(wire, uint32_t(chunks));
    for (size_t i = 0; i < chunks; ++i) {
        const size_t start = i * kLargestBloscChunk;
        const auto part =
            elements.subspan(start, std::min(kLargestBloscChunk, elements.size() - start));
        const std::vector<std::byte> chunk = write_blosc_chunk(part, element_bytes);
        append_number(wire, uint64_t(part.size()));
        append_number(wire, uint64_t(chunk.size()));
        append(chunk);
    }
    return wire;
}

const char* net_name(ScalarType type) {
    constexpr const char* names[] = {"uint8", "int8", "uint16", "int16", "float32"};
    return names[static_cast<size_t>(type)];
}

} // namespace

Result<std::vector<uint8_t>> read_net_array(std::span<const std::byte> wire,
                                            std::span<const int64_t> shape) {
    Reader reader(wire);
    PALPATE_TRY(expect_header(reader, shape));
    uint64_t left = 1;
    for (const int64_t size : shape)
        left *= uint64_t(size);
    PALPATE_TRY(const uint32_t chunks, reader.number<uint32_t>());
    const uint64_t expected = (left + kLargestBloscChunk - 1) / kLargestBloscChunk;
    if (chunks < expected || chunks > std::max<uint64_t>(left, 1))
        return fail("expected an array of {} chunks, found {}", expected, chunks);
    std::vector<uint8_t> elements(left);
    for (uint32_t i = 0; i < chunks; ++i) {
        PALPATE_TRY(const uint64_t bytes, reader.number<uint64_t>());
        PALPATE_TRY(const uint64_t compressed, reader.number<uint64_t>());
        if (bytes > left || bytes > kLargestBloscChunk)
            return fail("expected a chunk of at most {} bytes, found {}",
                        std::min<uint64_t>(left, kLargestBloscChunk), bytes);
        PALPATE_TRY(const std::span<const std::byte> chunk, reader.take(compressed));
        const auto out = std::span(elements).subspan(elements.size() - left, bytes);
        PALPATE_TRY(read_blosc_chunk(chunk, std::as_writable_bytes(out)));
        left -= bytes;
    }
    if (left != 0)
        return fail("expected {} elements of an array, found {}", elements.size(),
                    elements.size() - left);
    if (reader.size() != 0)
        return fail("expected the end of an array, found {} more bytes", reader.size());
    return elements;
}

std::vector<std::byte> write_net_array(std::span<const uint8_t> bytes,
                                       std::span<const int64_t> shape) {
    return write_array(std::as_bytes(bytes), "uint8", 1, shape);
}

std::vector<std::byte> write_net_image(const Volume& volume) {
    const glm::uvec3 size = volume.size();
    const std::array<int64_t, 4> shape{1, size.z, size.y, size.x};
    return visit_scalar(volume.type(), [&](auto type) {
        using T = decltype(type);
        std::vector<T> samples(sample_count(volume.grid()));
        read_box<T>(volume, {0, 0, 0}, glm::ivec3(size), packed(size), samples.data());
        if constexpr (std::is_floating_point_v<T>) {
            const T least = volume.range().empty() ? T{0} : volume.range().min;
            std::replace_if(
                samples.begin(), samples.end(), [](T v) { return !std::isfinite(v); }, least);
        }
        return write_array(std::as_bytes(std::span(samples)), net_name(volume.type()), sizeof(T),
                           shape);
    });
}

} // namespace palpate
