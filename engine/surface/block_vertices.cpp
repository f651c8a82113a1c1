#include <algorithm>
#include <cmath>

#include "engine/base/clones.h"
#include "engine/surface/block_parts.h"

namespace palpate::block {

namespace {

constexpr float kMostFraction = 1.0f - kLeastFraction;

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
glm::vec3 against(glm::dvec3 gradient, int axis, bool falling) {
    const double length =
        std::sqrt(gradient.x * gradient.x + gradient.y * gradient.y + gradient.z * gradient.z);
    if (!(length > 0.0 && length < 1e300))
        return along_axis(axis, falling);
    return {static_cast<float>(-gradient.x / length), static_cast<float>(-gradient.y / length),
            static_cast<float>(-gradient.z / length)};
}

// From the slopes at an edge's ends, where the square of what lies between is beyond floats. Slopes
// that cancel do so in floats, as in shaders/lib/extract_vertex.glsl: what they leave decides the
// direction, or the edge does where that is nothing. Only very small and large ones take doubles.
[[gnu::noinline]] glm::vec3 careful_normal(glm::vec3 low, glm::vec3 high, float t, glm::vec3 scale,
                                           int axis, bool falling) {
    float largest = 0.0f;
    for (int i = 0; i < 3; ++i)
        largest = std::max({largest, std::abs(low[i]), std::abs(high[i])});
    if (largest > 0x1p-100f && largest < 0x1p126f) {
        const glm::vec3 between(low.x + t * (high.x - low.x), low.y + t * (high.y - low.y),
                                low.z + t * (high.z - low.z));
        return against(glm::dvec3(between) * glm::dvec3(scale), axis, falling);
    }
    const glm::dvec3 a(low), b(high);
    return against((a + (b - a) * double{t}) * glm::dvec3(scale), axis, falling);
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
            c.normal = careful_normal(l, h, t, scale, axis, *low > *high);
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
            against(usable ? gradient : -glm::dvec3(of_edges), 2, true)};
}

} // namespace palpate::block
