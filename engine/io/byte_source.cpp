#include "engine/io/byte_source.h"

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <limits>

namespace palpate::io {

namespace {

constexpr size_t kPackedBytes = 1 << 16;
constexpr int kGzipOrZlib = 15 + 32; // zlib.h: window of 2^15, header recognised by itself
constexpr int kBare = -15;           // and without one
constexpr auto kGzipMagic = static_cast<std::byte>(0x1f);

template <class Word, class Swap>
void swap_words(std::span<std::byte> bytes, const Swap& swap) {
    auto* const words = reinterpret_cast<Word*>(bytes.data());
    std::transform(words, words + bytes.size() / sizeof(Word), words, swap);
}

} // namespace

void swap_bytes(std::span<std::byte> bytes, size_t word_bytes) {
    if (word_bytes == 2)
        swap_words<uint16_t>(bytes, [](uint16_t word) { return __builtin_bswap16(word); });
    if (word_bytes == 4)
        swap_words<uint32_t>(bytes, [](uint32_t word) { return __builtin_bswap32(word); });
    if (word_bytes == 8)
        swap_words<uint64_t>(bytes, [](uint64_t word) { return __builtin_bswap64(word); });
}

Result<Packing> packing_of(const std::filesystem::path& path) {
    PALPATE_TRY(ByteSource source, ByteSource::open(path, Packing::none));
    std::array<std::byte, 2> start{};
    PALPATE_TRY(const size_t got, source.read(start));
    const bool is_gzip = got == 2 && start[0] == kGzipMagic && start[1] == std::byte{0x8b};
    return is_gzip ? Packing::deflate : Packing::none;
}

void ByteSource::End::operator()(z_stream_s* stream) const {
    inflateEnd(stream);
    delete stream;
}

Result<ByteSource> ByteSource::open(const std::filesystem::path& path, Packing packing,
                                    uint64_t offset) {
    ByteSource source(path, Fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC)));
    if (!source.fd_)
        return fail("{}: cannot be read: {}", path.string(), std::strerror(errno));
    if (offset > static_cast<uint64_t>(std::numeric_limits<off_t>::max()) ||
        ::lseek(source.fd_.get(), static_cast<off_t>(offset), SEEK_SET) < 0)
        return fail("{}: cannot be read from byte {}", path.string(), offset);
    if (packing != Packing::none) {
        source.packed_.resize(kPackedBytes);
        source.stream_.reset(new z_stream_s{});
        if (inflateInit2(source.stream_.get(), packing == Packing::deflate ? kGzipOrZlib : kBare) !=
            Z_OK)
            return fail("{}: no memory to unpack it", path.string());
    }
    return source;
}

Result<size_t> ByteSource::read_file(std::span<std::byte> out) {
    size_t done = 0;
    while (done < out.size()) {
        const ssize_t got = ::read(fd_.get(), out.data() + done, out.size() - done);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            return fail("{}: cannot be read: {}", path_.string(), std::strerror(errno));
        if (got == 0)
            break;
        done += static_cast<size_t>(got);
    }
    return done;
}

Result<bool> ByteSource::refill() {
    if (stream_->avail_in > 0)
        return true;
    PALPATE_TRY(const size_t got, read_file(packed_));
    stream_->next_in = reinterpret_cast<Bytef*>(packed_.data());
    stream_->avail_in = static_cast<uInt>(got);
    return got > 0;
}

Result<bool> ByteSource::begin_next() {
    PALPATE_TRY(const bool more, refill());
    // Bytes that follow the last member and begin no other are padding, as gzip takes them.
    if (!more || static_cast<std::byte>(*stream_->next_in) != kGzipMagic)
        return false;
    inflateReset(stream_.get());
    return true;
}

Result<size_t> ByteSource::read(std::span<std::byte> out) {
    if (!stream_)
        return fd_ ? read_file(out) : Result<size_t>(0);
    size_t done = 0;
    while (done < out.size()) {
        PALPATE_TRY(const bool more, refill());
        if (!more)
            return fail("{}: its compressed data are cut off", path_.string());
        const size_t room = std::min<size_t>(out.size() - done, std::numeric_limits<uInt>::max());
        stream_->next_out = reinterpret_cast<Bytef*>(out.data() + done);
        stream_->avail_out = static_cast<uInt>(room);
        const int status = inflate(stream_.get(), Z_NO_FLUSH);
        done += room - stream_->avail_out;
        if (status == Z_STREAM_END) {
            PALPATE_TRY(const bool next, begin_next());
            if (!next) {
                stream_.reset();
                fd_ = Fd();
                break;
            }
        } else if (status != Z_OK && status != Z_BUF_ERROR) {
            return fail("{}: its compressed data are damaged", path_.string());
        }
    }
    return done;
}

Result<uint64_t> ByteSource::skip(uint64_t count) {
    if (!stream_ && fd_) {
        const int fd = fd_.get();
        const off_t at = ::lseek(fd, 0, SEEK_CUR), end = ::lseek(fd, 0, SEEK_END);
        const uint64_t passed =
            std::min(count, static_cast<uint64_t>(std::max(end - at, off_t{0})));
        if (at < 0 || end < 0 || ::lseek(fd, at + static_cast<off_t>(passed), SEEK_SET) < 0)
            return fail("{}: cannot be read: {}", path_.string(), std::strerror(errno));
        return passed;
    }
    std::array<std::byte, 1 << 16> passed;
    uint64_t done = 0;
    while (done < count) {
        const size_t part = std::min<uint64_t>(passed.size(), count - done);
        PALPATE_TRY(const size_t got, read({passed.data(), part}));
        done += got;
        if (got < part)
            break;
    }
    return done;
}

} // namespace palpate::io
