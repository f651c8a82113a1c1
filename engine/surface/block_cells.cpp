#include "engine/surface/block_cells.h"

#include <algorithm>
#include <bit>

#include "engine/base/clones.h"

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace palpate::block {

static_assert(std::endian::native == std::endian::little, "eight rows are taken as one number");

namespace {

// Crossed edges that start in a row, by axis.
struct RowEdges {
    uint32_t x, y, z;
    uint32_t any() const { return x | y | z; }
};
struct Masks {
    uint32_t samples, edges_x; // that exist along a row
    explicit Masks(Last last) : samples((2u << last.x) - 1u), edges_x((1u << last.x) - 1u) {}
};
inline RowEdges row_edges(const Signs& s, Last last, Masks masks, int y, int z) {
    const uint32_t row = s.row[z][y];
    return {(row ^ row >> 1) & masks.edges_x,
            y < last.y ? (row ^ s.row[z][y + 1]) & masks.samples : 0u,
            z < last.z ? (row ^ s.row[z + 1][y]) & masks.samples : 0u};
}

// The crossed edges that start in a layer of the block: bit x + 8 y.
struct LayerEdges {
    uint64_t x, y, z;
    uint64_t any() const { return x | y | z; }
};
uint64_t rows_below(int count) {
    return count >= kSide ? ~uint64_t{0} : (uint64_t{1} << (8 * count)) - 1;
}
[[gnu::always_inline]] inline LayerEdges layer_edges(const Signs& s, Last last, int z) {
    const auto& here = s.row[z];
    const auto& above = s.row[z + 1];
    const Masks masks(last);
    std::array<uint8_t, 8> x, y, up;
    for (int i = 0; i < kSide; ++i) {
        x[i] = static_cast<uint8_t>((here[i] ^ here[i] >> 1) & masks.edges_x);
        y[i] = static_cast<uint8_t>((here[i] ^ here[i + 1]) & masks.samples);
        up[i] = static_cast<uint8_t>((here[i] ^ above[i]) & masks.samples);
    }
    const uint64_t rows = z > last.z ? 0 : rows_below(last.y + 1);
    return {std::bit_cast<uint64_t>(x) & rows,
            std::bit_cast<uint64_t>(y) & rows_below(last.y) & rows,
            z < last.z ? std::bit_cast<uint64_t>(up) & rows : 0};
}
// In each byte, how many of its bits are set.
uint64_t bits_in_bytes(uint64_t v) {
    v -= v >> 1 & 0x5555555555555555;
    v = (v & 0x3333333333333333) + (v >> 2 & 0x3333333333333333);
    return (v + (v >> 4)) & 0x0f0f0f0f0f0f0f0f;
}

} // namespace

Signs signs_of(const Samples& samples, float iso) {
    Signs signs;
    for (int z = 0; z < 10; ++z)
        for (int y = 0; y < 10; ++y) {
            const float* row = samples.value.data() + Samples::at(0, y, z);
            uint32_t bits = 0;
#if defined(__SSE2__)
            const __m128 level = _mm_set1_ps(iso);
            for (int x = 0; x < 12; x += 4)
                bits |= static_cast<uint32_t>(
                            _mm_movemask_ps(_mm_cmpge_ps(_mm_loadu_ps(row + x), level)))
                        << x;
            bits &= 0x3ff;
#else
            for (int x = 0; x < 10; ++x)
                bits |= static_cast<uint32_t>(row[x] >= iso) << x;
#endif
            signs.row[z][y] = static_cast<uint16_t>(bits);
        }
    return signs;
}

PALPATE_CLONES
void count_edges(const Signs& signs, Last last, Count& count) {
    uint32_t total = 0;
    for (int z = 0; z < kSide; ++z) {
        const LayerEdges e = layer_edges(signs, last, z);
        // Byte y: edges of rows 0 .. y, at most 8 x 24.
        const uint64_t upto =
            (bits_in_bytes(e.x) + bits_in_bytes(e.y) + bits_in_bytes(e.z)) * 0x0101010101010101;
        for (int y = 0; y < kSide; ++y)
            count.row_start[y + 8 * z] =
                static_cast<uint16_t>(total + (upto << 8 >> (8 * y) & 0xff));
        total += static_cast<uint32_t>(upto >> 56);
    }
    count.edge_vertices = total;
}

PALPATE_CLONES
void find_cells(const Signs& signs, Last last, Cells& cells) {
    const glm::ivec3 size = glm::min(last, Last(kSide));
    const uint32_t in_row = (1u << size.x) - 1u;
    int count = 0;
    cells.rows.fill(0);
    for (int z = 0; z < size.z; ++z) {
        const auto& lower = signs.row[z];
        const auto& upper = signs.row[z + 1];
        std::array<uint8_t, 8> in_rows;
        for (int y = 0; y < kSide; ++y) {
            const uint32_t any = lower[y] | lower[y + 1] | upper[y] | upper[y + 1];
            const uint32_t all = lower[y] & lower[y + 1] & upper[y] & upper[y + 1];
            in_rows[y] = static_cast<uint8_t>((any | any >> 1) & ~(all & all >> 1) & in_row);
        }
        uint64_t crossed = std::bit_cast<uint64_t>(in_rows) & rows_below(size.y); // bit x + 8 y
        uint64_t first_bits = crossed | crossed >> 4;
        first_bits |= first_bits >> 2;
        first_bits = (first_bits | first_bits >> 1) & 0x0101010101010101;
        const auto rows = static_cast<uint32_t>(first_bits * 0x0102040810204080 >> 56); // bit y
        // The cells' own two rows and one to each side, in y and in z.
        const auto read = static_cast<uint16_t>(rows | rows << 1 | rows << 2 | rows << 3);
        for (int k = 0; k < 4; ++k)
            cells.rows[z + k] |= read;
        std::array<uint64_t, 8> four; // the rows of the cells (., y, z), 16 bits each
        for (int y = 0; y < kSide; ++y)
            four[y] = lower[y] | uint64_t{lower[y + 1]} << 16 | uint64_t{upper[y]} << 32 |
                      uint64_t{upper[y + 1]} << 48;
        for (; crossed != 0; crossed &= crossed - 1) {
            const int at = std::countr_zero(crossed), x = at & 7, y = at >> 3;
            // The two bits of each row, moved side by side by one multiplication: no two of its
            // terms meet.
            const uint64_t pairs = four[y] >> x & 0x0003000300030003;
            constexpr uint64_t kGather =
                uint64_t{1} << 48 | uint64_t{1} << 34 | uint64_t{1} << 20 | uint64_t{1} << 6;
            cells.first_edge[count] = static_cast<uint16_t>(edge_number(x, y, z, 0));
            cells.cell_case[count] = static_cast<uint8_t>(pairs * kGather >> 48);
            ++count;
        }
    }
    cells.count = count;
}

PALPATE_CLONES
int own_edges(const Signs& signs, Last last, uint16_t* numbers) {
    uint16_t* out = numbers;
    for (int z = 0; z < kSide; ++z) {
        const LayerEdges e = layer_edges(signs, last, z);
        for (uint64_t left = e.any(); left != 0; left &= left - 1) {
            const int at = std::countr_zero(left);
            const int first = edge_number(at & 7, at >> 3, z, 0);
            *out = static_cast<uint16_t>(first);
            out += e.x >> at & 1;
            *out = static_cast<uint16_t>(first + 1);
            out += e.y >> at & 1;
            *out = static_cast<uint16_t>(first + 2);
            out += e.z >> at & 1;
        }
    }
    return static_cast<int>(out - numbers);
}

PALPATE_CLONES
int borrowed_edges(const Signs& signs, Last last, BorrowedEdge* edges) {
    const Masks masks(last);
    BorrowedEdge* out = edges;
    for (int z = 0; z <= std::min(last.z, kSide); ++z)
        for (int y = 0; y <= std::min(last.y, kSide); ++y) {
            const bool own_row = y < kSide && z < kSide;
            const RowEdges all = row_edges(signs, last, masks, y, z);
            // Those of this block's cells: an edge that leads out of sample 8 is none.
            const RowEdges e{all.x & 0xffu, y < kSide ? all.y & 0x1ffu : 0u,
                             z < kSide ? all.z & 0x1ffu : 0u};
            const int first = edge_number(0, y, z, 0);
            for (uint32_t left = e.any() & (own_row ? 0x100u : 0x1ffu); left != 0;
                 left &= left - 1) {
                const int x = std::countr_zero(left);
                const uint32_t below = x == kSide ? 0u : (1u << x) - 1u;
                int before = std::popcount(all.x & below) + std::popcount(all.y & below) +
                             std::popcount(all.z & below);
                const auto owner =
                    static_cast<uint8_t>((x == kSide) | (y == kSide) << 1 | (z == kSide) << 2);
                const auto row = static_cast<uint8_t>((y & 7) + 8 * (z & 7));
                const auto add = [&](uint32_t wanted, uint32_t crossed, int axis) {
                    *out = {static_cast<uint16_t>(first + 4 * x + axis), owner, row,
                            static_cast<uint8_t>(before)};
                    out += wanted >> x & 1;
                    before += static_cast<int>(crossed >> x & 1);
                };
                add(e.x, all.x, 0);
                add(e.y, all.y, 1);
                add(e.z, all.z, 2);
            }
        }
    return static_cast<int>(out - edges);
}

} // namespace palpate::block
