#include "engine/surface/block_cells.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "engine/surface/clones.h"

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace palpate::block {

static_assert(std::endian::native == std::endian::little, "eight rows are taken as one number");

namespace {

constexpr float kMostFraction = 1.0f - kLeastFraction;

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

// The classic table with edges as differences of edge numbers.
struct NumberTable {
    std::array<uint8_t, 256> count;
    std::array<std::array<uint16_t, 3 * ClassicTable::kMaxTriangles + 1>, 256> edges{};
    std::array<bool, 256> needs_values;
};
std::array<uint16_t, 12> make_edge_differences() {
    std::array<uint16_t, 12> differences{};
    for (int e = 0; e < 12; ++e) {
        const CellEdge edge = cell_edge(e);
        differences[e] = static_cast<uint16_t>(
            edge_number(edge.corner & 1, edge.corner >> 1 & 1, edge.corner >> 2 & 1, edge.axis) -
            edge_number(0, 0, 0, 0));
    }
    return differences;
}
const std::array<uint16_t, 12>& edge_differences() {
    static const std::array<uint16_t, 12> differences = make_edge_differences();
    return differences;
}
const NumberTable& number_table() {
    static const NumberTable table = [] {
        NumberTable t;
        const ClassicTable& classic = classic_table();
        t.count = classic.triangle_count;
        for (int c = 0; c < 256; ++c) {
            for (int i = 0; i < 3 * t.count[c]; ++i)
                t.edges[c][i] = edge_differences()[classic.edges[c][i]];
            const auto inside = static_cast<uint8_t>(c); // as CorrectTable, which takes longer
            t.needs_values[c] = ambiguous_faces(inside) != 0 || cell_loops(inside, 0).size() > 1;
        }
        return t;
    }();
    return table;
}

// Of the cell whose lowest corner starts this edge.
std::array<float, 8> corners_of(const Samples& samples, int first_edge) {
    const float* low = samples.value.data() + first_edge / 4;
    std::array<float, 8> corners;
    for (int c = 0; c < 8; ++c)
        corners[c] = low[(c & 1) + 12 * (c >> 1 & 1) + 132 * (c >> 2 & 1)];
    return corners;
}

// How far from a to b the interpolant reaches iso. NaN is no data: the wall is beside the other.
inline float fraction(float a, float b, float iso) {
    const float t = (iso - a) / (b - a);
    return t > kLeastFraction ? (t < kMostFraction ? t : kMostFraction) : kLeastFraction;
}

glm::vec3 along_axis(int axis, bool falling) {
    glm::vec3 n(0.0f);
    n[axis] = falling ? 1.0f : -1.0f;
    return n;
}

// Against a gradient of any length; along the edge where there is none.
[[gnu::noinline]] glm::vec3 careful_normal(glm::dvec3 gradient, int axis, bool falling) {
    const double length =
        std::sqrt(gradient.x * gradient.x + gradient.y * gradient.y + gradient.z * gradient.z);
    if (!(length > 0.0 && length < 1e300))
        return along_axis(axis, falling);
    return {static_cast<float>(-gradient.x / length), static_cast<float>(-gradient.y / length),
            static_cast<float>(-gradient.z / length)};
}

// Twice the slope across a sample. With gaps, a missing neighbour counts as equal to it.
template <bool kGaps>
[[gnu::always_inline]] inline glm::vec3 differences(const float* v) {
    if constexpr (!kGaps)
        return {v[1] - v[-1], v[12] - v[-12], v[132] - v[-132]};
    glm::vec3 d;
    for (int a = 0; a < 3; ++a) {
        const float below = v[-Samples::kStride[a]], above = v[Samples::kStride[a]];
        d[a] = (above == above ? above : v[0]) - (below == below ? below : v[0]);
    }
    return d;
}

struct Crossing {
    glm::vec3 position; // samples of the volume
    glm::vec3 normal;
};

// The same bits with and without gaps, where there are none: blocks that share an edge agree.
template <bool kGaps, bool kNormal>
[[gnu::always_inline]] inline Crossing crossing(const float* samples, int number, glm::ivec3 origin,
                                                float iso, glm::vec3 scale) {
    const int axis = number & 3;
    const float* low = samples + number / 4;
    const float* high = low + Samples::kStride[axis];
    Crossing c{glm::vec3(origin + sample_of(number)), {}};
    if (kGaps && (*low != *low || *high != *high)) {
        const bool falling = *high != *high;
        c.position[axis] += falling ? kLeastFraction : kMostFraction;
        c.normal = along_axis(axis, falling);
        return c;
    }
    const float t = fraction(*low, *high, iso);
    c.position[axis] += t;
    if constexpr (kNormal) {
        const glm::vec3 l = differences<kGaps>(low), h = differences<kGaps>(high);
        const float gx = (l.x + t * (h.x - l.x)) * scale.x;
        const float gy = (l.y + t * (h.y - l.y)) * scale.y;
        const float gz = (l.z + t * (h.z - l.z)) * scale.z;
        const float squared = gx * gx + gy * gy + gz * gz;
        if (squared > 1e-30f && squared < 1e30f) [[likely]] {
            const float inverse = -1.0f / std::sqrt(squared);
            c.normal = {gx * inverse, gy * inverse, gz * inverse};
        } else {
            const glm::dvec3 a(l), b(h);
            c.normal =
                careful_normal((a + (b - a) * double{t}) * glm::dvec3(scale), axis, *low > *high);
        }
    }
    return c;
}

template <bool kNormal>
void make_all_with_gaps(const Samples& samples, const Place& place, float iso,
                        const uint16_t* numbers, int count, glm::vec3* positions,
                        glm::vec3* normals) {
    const glm::vec3 scale = 0.5f / place.spacing_mm;
    for (int i = 0; i < count; ++i) {
        const Crossing c =
            crossing<true, kNormal>(samples.value.data(), numbers[i], place.origin, iso, scale);
        positions[i] = c.position * place.spacing_mm;
        if constexpr (kNormal)
            normals[i] = c.normal;
    }
}

// sample_of() of edges 4 i, a byte an axis, each one more.
const std::array<uint32_t, Samples::kCount>& places() {
    static const std::array<uint32_t, Samples::kCount> table = [] {
        std::array<uint32_t, Samples::kCount> t{};
        for (int i = 0; i < Samples::kCount; ++i) {
            const glm::uvec3 at(sample_of(4 * i) + 1);
            t[i] = at.x | at.y << 8 | at.z << 16;
        }
        return t;
    }();
    return table;
}

// As crossing() does, bit for bit, some vertices at a time: their samples are gathered one by one,
// the rest is done for eight at once where the processor can.
template <bool kNormal>
[[gnu::always_inline]] inline void make_all(const Samples& samples, const Place& place, float iso,
                                            const uint16_t* numbers, int count,
                                            glm::vec3* positions, glm::vec3* normals) {
    constexpr int kBatch = 64;
    const glm::vec3 scale = 0.5f / place.spacing_mm;
    const float* const values = samples.value.data();
    const uint32_t* const place_of = places().data();
    const glm::ivec3 before = place.origin - 1;
    alignas(64) int32_t axes[kBatch], at[kBatch];
    alignas(64) float low[kBatch], high[kBatch], p[3][kBatch], normal[3][kBatch];
    alignas(64) float at_low[3][kBatch], at_high[3][kBatch];
    alignas(64) float usable[kBatch];
    for (int first = 0; first < count; first += kBatch) {
        const int n = std::min(kBatch, count - first);
        for (int i = 0; i < n; ++i) {
            const int number = numbers[first + i], axis = number & 3;
            const float* l = values + number / 4;
            const float* h = l + Samples::kStride[axis];
            low[i] = *l;
            high[i] = *h;
            axes[i] = axis;
            at[i] = static_cast<int32_t>(place_of[number / 4]);
            if constexpr (kNormal)
                for (int a = 0; a < 3; ++a) {
                    constexpr const int* stride = Samples::kStride;
                    at_low[a][i] = l[stride[a]] - l[-stride[a]];
                    at_high[a][i] = h[stride[a]] - h[-stride[a]];
                }
        }
        const int whole = (n + 7) / 8 * 8; // what lies beyond n is not used
        for (int i = n; i < whole; ++i) {
            low[i] = high[i] = 0.0f;
            axes[i] = at[i] = 0;
            for (int a = 0; a < 3; ++a)
                at_low[a][i] = at_high[a][i] = 0.0f;
        }
        for (int i = 0; i < whole; ++i) {
            const float t = fraction(low[i], high[i], iso);
            for (int a = 0; a < 3; ++a)
                p[a][i] = (static_cast<float>(before[a] + (at[i] >> 8 * a & 0xff)) +
                           (axes[i] == a ? t : 0.0f)) *
                          place.spacing_mm[a];
            if constexpr (kNormal) {
                const float gx = (at_low[0][i] + t * (at_high[0][i] - at_low[0][i])) * scale.x;
                const float gy = (at_low[1][i] + t * (at_high[1][i] - at_low[1][i])) * scale.y;
                const float gz = (at_low[2][i] + t * (at_high[2][i] - at_low[2][i])) * scale.z;
                const float squared = gx * gx + gy * gy + gz * gz;
                const float inverse = -1.0f / std::sqrt(squared);
                normal[0][i] = gx * inverse;
                normal[1][i] = gy * inverse;
                normal[2][i] = gz * inverse;
                usable[i] = squared > 1e-30f && squared < 1e30f ? 1.0f : 0.0f;
            }
        }
        for (int i = 0; i < n; ++i) {
            positions[first + i] = {p[0][i], p[1][i], p[2][i]};
            if constexpr (kNormal)
                normals[first + i] = {normal[0][i], normal[1][i], normal[2][i]};
        }
        if constexpr (kNormal)
            for (int i = 0; i < n; ++i)
                if (usable[i] == 0.0f) [[unlikely]]
                    normals[first + i] =
                        crossing<false, true>(values, numbers[first + i], place.origin, iso, scale)
                            .normal;
    }
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
        for (; crossed != 0; crossed &= crossed - 1) {
            const int at = std::countr_zero(crossed), x = at & 7, y = at >> 3;
            cells.first_edge[count] = static_cast<uint16_t>(edge_number(x, y, z, 0));
            cells.cell_case[count] =
                static_cast<uint8_t>((lower[y] >> x & 3) | (lower[y + 1] >> x & 3) << 2 |
                                     (upper[y] >> x & 3) << 4 | (upper[y + 1] >> x & 3) << 6);
            ++count;
        }
    }
    cells.count = count;
}

void count_cells(const Cells& cells, Count& count) {
    const NumberTable& table = number_table();
    uint32_t triangles = 0;
    bool needs_values = false;
    for (int i = 0; i < cells.count; ++i) {
        triangles += table.count[cells.cell_case[i]];
        needs_values |= table.needs_values[cells.cell_case[i]];
    }
    count.triangles = triangles;
    count.inner_vertices = 0;
    count.needs_values = needs_values;
}

void count_correct_cells(const Cells& cells, const Samples& samples, float iso, Count& count) {
    const NumberTable& table = number_table();
    const CorrectTable& correct = correct_table();
    count.triangles = 0;
    count.inner_vertices = 0;
    for (int i = 0; i < cells.count; ++i) {
        const uint8_t cell_case = cells.cell_case[i];
        if (!table.needs_values[cell_case]) {
            count.triangles += table.count[cell_case];
            continue;
        }
        const CellSurface& surface = correct.surface(
            cell_case, corner_values(corners_of(samples, cells.first_edge[i]), iso));
        count.triangles += static_cast<uint32_t>(surface.triangles.size());
        count.inner_vertices += static_cast<uint32_t>(surface.inner.size());
    }
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

PALPATE_CLONES
void make_vertices(const Samples& samples, const Place& place, float iso, const uint16_t* numbers,
                   int count, glm::vec3* positions, glm::vec3* normals) {
    if (samples.has_gaps && normals)
        make_all_with_gaps<true>(samples, place, iso, numbers, count, positions, normals);
    else if (samples.has_gaps)
        make_all_with_gaps<false>(samples, place, iso, numbers, count, positions, normals);
    else if (normals)
        make_all<true>(samples, place, iso, numbers, count, positions, normals);
    else
        make_all<false>(samples, place, iso, numbers, count, positions, normals);
}

uint32_t make_triangles(const Cells& cells, const uint32_t* vertex_of_edge,
                        std::span<glm::uvec3> triangles) {
    const NumberTable& table = number_table();
    constexpr std::ptrdiff_t kMost = ClassicTable::kMaxTriangles;
    glm::uvec3* out = triangles.data();
    glm::uvec3* const end = out + triangles.size();
    for (int i = 0; i < cells.count; ++i) {
        const uint32_t* vertex = vertex_of_edge + cells.first_edge[i];
        const uint16_t* edge = table.edges[cells.cell_case[i]].data();
        const int n = table.count[cells.cell_case[i]];
        const auto put = [&](int t) {
            out[t] = {vertex[edge[3 * t]], vertex[edge[3 * t + 1]], vertex[edge[3 * t + 2]]};
        };
        if (end - out >= kMost) { // what is too much, the next cell writes over: fewer branches
            put(0);
            put(1);
            if (n > 2) {
                put(2);
                put(3);
                put(4);
            }
        } else {
            for (int t = 0; t < n; ++t)
                put(t);
        }
        out += n;
    }
    return static_cast<uint32_t>(out - triangles.data());
}

namespace {

// A vertex within a cell: against the interpolant's gradient there, or where a corner is missing
// against that of the edges.
Crossing inner_crossing(const InnerVertex& inner, const Samples& samples, glm::ivec3 cell,
                        glm::ivec3 origin, float iso, glm::vec3 scale) {
    glm::vec3 within(0.0f), of_edges(0.0f);
    for (int e = 0; e < 12; ++e) {
        if (inner.weight[e] == 0.0f)
            continue;
        const Crossing on_edge = crossing<true, true>(
            samples.value.data(), edge_number(cell.x, cell.y, cell.z, 0) + edge_differences()[e],
            -cell, iso, scale);
        within += inner.weight[e] * on_edge.position;
        of_edges += inner.weight[e] * on_edge.normal;
    }
    const std::array<float, 8> v = corners_of(samples, edge_number(cell.x, cell.y, cell.z, 0));
    const glm::dvec3 p(within);
    glm::dvec3 gradient(0.0);
    for (int corner = 0; corner < 8; ++corner) {
        glm::dvec3 weight, slope;
        for (int a = 0; a < 3; ++a) {
            const bool high = corner >> a & 1;
            weight[a] = high ? p[a] : 1.0 - p[a];
            slope[a] = high ? 1.0 : -1.0;
        }
        gradient += double{v[corner]} * slope *
                    glm::dvec3(weight.y * weight.z, weight.x * weight.z, weight.x * weight.y);
    }
    gradient *= glm::dvec3(scale);
    const bool usable =
        std::isfinite(gradient.x + gradient.y + gradient.z) && gradient != glm::dvec3(0.0);
    return {glm::vec3(origin + cell) + within,
            careful_normal(usable ? gradient : -glm::dvec3(of_edges), 2, true)};
}

} // namespace

uint32_t make_correct_triangles(const Cells& cells, const uint32_t* vertex_of_edge,
                                const Samples& samples, const Place& place, float iso,
                                const Output& output) {
    const NumberTable& table = number_table();
    const CorrectTable& correct = correct_table();
    const glm::vec3 scale = 0.5f / place.spacing_mm;
    glm::uvec3* out = output.triangles;
    uint32_t inner_written = 0;
    for (int i = 0; i < cells.count; ++i) {
        const uint32_t* vertex = vertex_of_edge + cells.first_edge[i];
        const uint8_t cell_case = cells.cell_case[i];
        if (!table.needs_values[cell_case]) {
            const uint16_t* edge = table.edges[cell_case].data();
            for (int n = table.count[cell_case]; n > 0; --n, edge += 3)
                *out++ = {vertex[edge[0]], vertex[edge[1]], vertex[edge[2]]};
            continue;
        }
        const CellSurface& surface = correct.surface(
            cell_case, corner_values(corners_of(samples, cells.first_edge[i]), iso));
        const auto of = [&](uint8_t v) {
            return v < 12 ? vertex[edge_differences()[v]]
                          : output.first_inner + inner_written + (v - 12u);
        };
        for (const auto& t : surface.triangles)
            *out++ = {of(t[0]), of(t[1]), of(t[2])};
        for (const InnerVertex& inner : surface.inner) {
            const Crossing c = inner_crossing(inner, samples, sample_of(cells.first_edge[i]),
                                              place.origin, iso, scale);
            output.inner_positions[inner_written] = c.position * place.spacing_mm;
            if (output.inner_normals)
                output.inner_normals[inner_written] = c.normal;
            ++inner_written;
        }
    }
    return static_cast<uint32_t>(out - output.triangles);
}

} // namespace palpate::block
