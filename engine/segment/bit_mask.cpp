#include "engine/segment/bit_mask.h"

#include <algorithm>
#include <cmath>

#include "engine/segment/label_samples.h"
#include "engine/segment/rows.h"

namespace palpate {

namespace {

// flip: all ones to work on the complement.
std::optional<BitMask> grown(const BitMask& mask, std::span<const ElementRow> element,
                             uint64_t flip, const Task& task) {
    int widest = 0;
    for (const ElementRow& row : element)
        widest = std::max(widest, row.half);
    BitMask out(mask.size());
    const size_t words = mask.words();
    const bool all = run_all(mask.size().z, task, [&](size_t z) {
        // Rows of the element that are as wide, joined; the widest ones first.
        std::vector<uint64_t> joined(words * size_t(widest + 1));
        const auto of = [&](int half) { return joined.data() + words * size_t(widest - half); };
        for (size_t y = 0; y < mask.size().y; ++y) {
            std::fill(joined.begin(), joined.end(), 0);
            for (const ElementRow& row : element) {
                const size_t ny = y + size_t(row.y), nz = z + size_t(row.z); // wraps round below 0
                if (ny >= mask.size().y || nz >= mask.size().z)
                    continue;
                const uint64_t* from = mask.row(ny, nz);
                uint64_t* to = of(row.half);
                for (size_t w = 0; w < words; ++w)
                    to[w] |= from[w] ^ flip;
            }
            // All rows that are wider than `half` are grown by a sample to each side.
            for (int half = widest; half > 0; --half) {
                uint64_t* from = of(half);
                uint64_t* to = of(half - 1);
                from[words - 1] &= mask.last_word(); // the complement ends with the row
                uint64_t before = 0;
                for (size_t w = 0; w < words; ++w) {
                    const uint64_t own = from[w], after = w + 1 < words ? from[w + 1] : 0;
                    to[w] |= own | own << 1 | own >> 1 | before >> 63 | after << 63;
                    before = own;
                }
            }
            uint64_t* to = out.row(y, z);
            for (size_t w = 0; w < words; ++w)
                to[w] = of(0)[w] ^ flip;
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

std::vector<ElementRow> element_of(Neighbours neighbours) {
    const int reach = neighbours == Neighbours::faces ? 1 : neighbours == Neighbours::edges ? 2 : 3;
    std::vector<ElementRow> rows;
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y)
            if (const int apart = std::abs(y) + std::abs(z); apart <= reach)
                rows.push_back({y, z, apart < reach ? 1 : 0});
    return rows;
}

std::vector<ElementRow> ball_of(glm::dvec3 spacing_mm, double reach_mm) {
    const glm::ivec3 most(reach_mm / spacing_mm);
    std::vector<ElementRow> rows;
    for (int z = -most.z; z <= most.z; ++z)
        for (int y = -most.y; y <= most.y; ++y) {
            const auto is_in = [&](int x) {
                return glm::length(glm::dvec3(x, y, z) * spacing_mm) <= reach_mm;
            };
            int half = -1;
            while (is_in(half + 1))
                ++half;
            if (half >= 0)
                rows.push_back({y, z, half});
        }
    return rows;
}

std::optional<BitMask> dilated(const BitMask& mask, std::span<const ElementRow> element,
                               const Task& task) {
    return grown(mask, element, 0, task);
}

std::optional<BitMask> eroded(const BitMask& mask, std::span<const ElementRow> element,
                              const Task& task) {
    return grown(mask, element, ~uint64_t{0}, task);
}

Result<Volume> volume_of(const BitMask& mask, const Grid& grid, const Task& task) {
    return make_rows<uint8_t>(grid, task, [&](uint32_t y, uint32_t z, std::span<uint8_t> row) {
        const uint64_t* bits = mask.row(y, z);
        for (size_t x = 0; x < row.size(); ++x)
            row[x] = uint8_t(bits[x / 64] >> x % 64 & 1);
    });
}

} // namespace palpate
