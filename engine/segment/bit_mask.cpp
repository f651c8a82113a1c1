#include "engine/segment/bit_mask.h"

#include "engine/segment/label_samples.h"
#include "engine/segment/rows.h"

namespace palpate {

namespace {

// All words of rows about (y, z) joined: `wide` those whose left and right neighbours count too.
struct Joined {
    std::vector<uint64_t> wide, plain;
};

// flip: all ones to work on the complement.
void join_rows(const BitMask& mask, size_t y, size_t z, int reach, uint64_t flip, Joined& out) {
    const size_t words = mask.words();
    out.wide.assign(words, 0);
    out.plain.assign(words, 0);
    for (int dz = -1; dz <= 1; ++dz)
        for (int dy = -1; dy <= 1; ++dy) {
            const int apart = std::abs(dy) + std::abs(dz);
            const size_t ny = y + size_t(dy), nz = z + size_t(dz); // wraps round below 0
            if (apart > reach || ny >= mask.size().y || nz >= mask.size().z)
                continue;
            const uint64_t* row = mask.row(ny, nz);
            std::vector<uint64_t>& to = apart < reach ? out.wide : out.plain;
            for (size_t w = 0; w < words; ++w)
                to[w] |= row[w] ^ flip;
        }
    out.wide[words - 1] &= mask.last_word(); // the complement ends with the row
}

std::optional<BitMask> grown(const BitMask& mask, Neighbours neighbours, uint64_t flip,
                             const Task& task) {
    const int reach = neighbours == Neighbours::faces ? 1 : neighbours == Neighbours::edges ? 2 : 3;
    BitMask out(mask.size());
    const size_t words = mask.words();
    const bool all = run_all(mask.size().z, task, [&](size_t z) {
        Joined joined;
        for (size_t y = 0; y < mask.size().y; ++y) {
            join_rows(mask, y, z, reach, flip, joined);
            uint64_t* to = out.row(y, z);
            for (size_t w = 0; w < words; ++w) {
                const uint64_t own = joined.wide[w];
                const uint64_t before = w > 0 ? joined.wide[w - 1] >> 63 : 0;
                const uint64_t after = w + 1 < words ? joined.wide[w + 1] << 63 : 0;
                to[w] = (own | own << 1 | own >> 1 | before | after | joined.plain[w]) ^ flip;
            }
            to[words - 1] &= mask.last_word();
        }
    });
    return all ? std::optional(std::move(out)) : std::nullopt;
}

} // namespace

std::optional<BitMask> mask_of(const Volume& labels, std::optional<uint16_t> label,
                               const Task& task) {
    const glm::uvec3 size = labels.size();
    BitMask out(size);
    const bool all = run_all(size.z, task, [&](size_t z) {
        // Whole words, so that the inner loop has a fixed length.
        const size_t width = out.words() * 64;
        std::vector<uint16_t> plane(size_t{size.x} * size.y), row(width, 0);
        read_labels(labels, {0, 0, int(z)}, {int(size.x), int(size.y), 1}, plane.data());
        for (size_t y = 0; y < size.y; ++y) {
            std::copy_n(plane.data() + y * size.x, size.x, row.data());
            uint64_t* to = out.row(y, z);
            for (size_t w = 0; w < out.words(); ++w) {
                uint64_t word = 0;
                for (size_t i = 0; i < 64; ++i) {
                    const uint16_t own = row[w * 64 + i];
                    word |= uint64_t{label ? own == *label : own != 0} << i;
                }
                to[w] = word;
            }
            to[out.words() - 1] &= out.last_word();
        }
    });
    return all ? std::optional(std::move(out)) : std::nullopt;
}

std::optional<BitMask> dilated(const BitMask& mask, Neighbours neighbours, const Task& task) {
    return grown(mask, neighbours, 0, task);
}

std::optional<BitMask> eroded(const BitMask& mask, Neighbours neighbours, const Task& task) {
    return grown(mask, neighbours, ~uint64_t{0}, task);
}

Result<Volume> volume_of(const BitMask& mask, const Grid& grid, const Task& task) {
    return make_rows<uint8_t>(grid, task, [&](uint32_t y, uint32_t z, std::span<uint8_t> row) {
        const uint64_t* bits = mask.row(y, z);
        for (size_t x = 0; x < row.size(); ++x)
            row[x] = uint8_t(bits[x / 64] >> x % 64 & 1);
    });
}

} // namespace palpate
