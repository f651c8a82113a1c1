#pragma once

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/io/byte_source.h"

namespace palpate::io {

// A file read forward, byte by byte or in blocks, that knows where it is.
class ForwardBytes {
 public:
    static Result<ForwardBytes> open(const std::filesystem::path& path) {
        PALPATE_TRY(ByteSource source, ByteSource::open(path, Packing::none));
        return ForwardBytes(std::move(source));
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
    static constexpr size_t kBlock = 1 << 16;
    explicit ForwardBytes(ByteSource source) : source_(std::move(source)), block_(kBlock) {}

    bool refill() {
        start_ += have_;
        next_ = 0;
        const Result<size_t> got = source_.read(block_);
        have_ = got ? *got : 0; // an error of reading ends the file
        return have_ > 0;
    }
    ByteSource source_;
    std::vector<std::byte> block_;
    uint64_t start_ = 0; // of the block, in the file
    size_t next_ = 0, have_ = 0;
};

// "IDAT" or bytes.
inline std::string shown(std::string_view bytes) {
    std::string text;
    for (const char c : bytes)
        text += std::isalpha(static_cast<unsigned char>(c))
                    ? std::string(1, c)
                    : fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    return text;
}

} // namespace palpate::io
