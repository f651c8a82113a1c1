#pragma once

#include <zstd.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <string_view>
#include <vector>

// Chunks and arrays made byte by byte from the published formats, apart from the code that is
// tested.
namespace palpate::wire {

using Bytes = std::vector<std::byte>;

inline void put(Bytes& out, uint64_t value, size_t bytes) {
    for (size_t i = 0; i < bytes; ++i)
        out.push_back(std::byte(uint8_t(value >> (8 * i))));
}

inline Bytes from_hex(std::string_view hex) {
    Bytes bytes;
    for (size_t i = 0; i + 1 < hex.size(); i += 2)
        bytes.push_back(std::byte(uint8_t(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16))));
    return bytes;
}

struct ChunkForm {
    size_t sample_bytes = 1, block_bytes = 64;
    bool is_shuffled = false, is_split = false;
};

// A chunk whose blocks lie in the file from the last to the first, as they may.
inline Bytes chunk_of(const Bytes& data, const ChunkForm& form) {
    const size_t count = (data.size() + form.block_bytes - 1) / form.block_bytes;
    std::vector<Bytes> blocks(count);
    for (size_t b = 0; b < count; ++b) {
        const size_t start = b * form.block_bytes;
        Bytes block(data.begin() + ptrdiff_t(start),
                    data.begin() + ptrdiff_t(std::min(data.size(), start + form.block_bytes)));
        if (form.is_shuffled) {
            const Bytes plain = block;
            const size_t samples = plain.size() / form.sample_bytes;
            for (size_t at = 0; at < samples * form.sample_bytes; ++at)
                block[at % form.sample_bytes * samples + at / form.sample_bytes] = plain[at];
        }
        const bool is_split = form.is_split && block.size() == form.block_bytes;
        const size_t streams = is_split ? form.sample_bytes : 1;
        const size_t each = block.size() / streams;
        for (size_t s = 0; s < streams; ++s) {
            const std::byte* stream = block.data() + s * each;
            bool is_run = true;
            for (size_t i = 0; i < each; ++i)
                is_run &= stream[i] == stream[0];
            if (is_run) {
                const auto value = std::to_integer<int>(stream[0]);
                put(blocks[b], uint32_t(-value), 4);
                if (value != 0)
                    put(blocks[b], 1, 1);
                continue;
            }
            Bytes packed(ZSTD_compressBound(each));
            packed.resize(ZSTD_compress(packed.data(), packed.size(), stream, each, 1));
            if (packed.size() >= each)
                packed.assign(stream, stream + each);
            put(blocks[b], packed.size(), 4);
            blocks[b].insert(blocks[b].end(), packed.begin(), packed.end());
        }
    }
    size_t total = 32 + 4 * count;
    std::vector<size_t> places(count);
    for (size_t b = count; b-- > 0;) {
        places[b] = total;
        total += blocks[b].size();
    }
    Bytes chunk;
    put(chunk, 5, 1); // version of the format, then that of the codec's
    put(chunk, 1, 1);
    put(chunk, 0x05 | (form.is_split ? 0 : 0x10) | 4 << 5, 1);
    put(chunk, form.sample_bytes, 1);
    put(chunk, data.size(), 4);
    put(chunk, form.block_bytes, 4);
    put(chunk, total, 4);
    put(chunk, form.is_shuffled ? 1ull << 40 : 0, 8); // filters: the sixth is the last
    put(chunk, 0, 8);
    for (const size_t place : places)
        put(chunk, place, 4);
    for (size_t b = count; b-- > 0;)
        chunk.insert(chunk.end(), blocks[b].begin(), blocks[b].end());
    return chunk;
}

// An array of bytes in chunks of at most `most` elements.
inline Bytes array_of(const Bytes& data, const std::vector<int64_t>& shape, std::string_view type,
                      size_t most, const ChunkForm& form) {
    Bytes wire;
    for (const char c : std::string_view("NNIA"))
        wire.push_back(std::byte(uint8_t(c)));
    for (const size_t byte : {size_t{1}, size_t{1}, shape.size(), type.size()})
        put(wire, byte, 1);
    for (const char c : type)
        wire.push_back(std::byte(uint8_t(c)));
    for (const int64_t size : shape)
        put(wire, uint64_t(size), 8);
    put(wire, (data.size() + most - 1) / most, 4);
    for (size_t at = 0; at < data.size(); at += most) {
        const Bytes part(data.begin() + ptrdiff_t(at),
                         data.begin() + ptrdiff_t(std::min(data.size(), at + most)));
        ChunkForm fitted = form;
        fitted.block_bytes = std::min(form.block_bytes, part.size());
        const Bytes chunk = chunk_of(part, fitted);
        put(wire, part.size(), 8);
        put(wire, chunk.size(), 8);
        wire.insert(wire.end(), chunk.begin(), chunk.end());
    }
    return wire;
}

// Bytes with runs and noise.
inline Bytes some_bytes(std::mt19937& random, size_t count) {
    Bytes bytes;
    while (bytes.size() < count) {
        const size_t run = std::min<size_t>(1 + random() % 200, count - bytes.size());
        const bool is_noise = random() % 4 == 0;
        const auto value = uint8_t(random() % 3);
        for (size_t i = 0; i < run; ++i)
            bytes.push_back(std::byte(is_noise ? uint8_t(random()) : value));
    }
    return bytes;
}

// One of the ways in which a reply is damaged: a byte, a number, a cut, a repetition.
inline void damage(std::mt19937& random, Bytes& bytes) {
    if (bytes.empty())
        return;
    const size_t at = random() % bytes.size();
    switch (random() % 5) {
        case 0:
            bytes[at] = std::byte(uint8_t(random()));
            break;
        case 1:
            bytes[at] ^= std::byte(uint8_t(1u << random() % 8));
            break;
        case 2: { // a number of four bytes, of the kind that overflows
            constexpr uint32_t kHard[] = {0, 1, 0x7fffffff, 0x80000000, 0xffffffff, 0x40000000};
            const uint32_t value = kHard[random() % 6];
            for (size_t i = 0; i < 4 && at + i < bytes.size(); ++i)
                bytes[at + i] = std::byte(uint8_t(value >> (8 * i)));
            break;
        }
        case 3:
            bytes.resize(at);
            break;
        default:
            bytes.insert(bytes.begin() + ptrdiff_t(at), bytes.begin(),
                         bytes.begin() + ptrdiff_t(std::min<size_t>(bytes.size(), 9)));
    }
}

} // namespace palpate::wire
