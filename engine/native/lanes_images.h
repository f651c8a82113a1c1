#pragma once

// Images of the translated shaders. Included by lanes.h. The general cases are compiled once for
// each instruction set (images.cpp), for one vector of lanes; what rays spend their time on is
// here.
namespace palpate::native {

// One of these a level and object file: the names must not meet.
namespace PALPATE_LEVEL {

// Coordinates of texels: x, y and z, or the layer in place of z.
struct Texel {
    IntPart x, y, z;
};
// All four channels, floats or integers by their bits; zeros outside the image or the mask.
void fetch_part(const Image& image, const Texel& at, MaskPart mask, UintPart* out);
void store_part(const Image& image, const Texel& at, MaskPart mask, const UintPart* values);
// The level of detail is 0. `dimensions` leaves the layer out.
void sample_part(const Image& image, const Sampler& sampler, int dimensions, const FloatPart* at,
                 MaskPart mask, UintPart* out);

} // namespace PALPATE_LEVEL

namespace {

namespace level = PALPATE_LEVEL;

// A bound image, and what is asked of it at every sample.
struct Texture {
    const Resource* bound;
    bool is_float; // one float a texel
    bool is_fast;  // and linear between texels, clamped to the edge, of two texels or more across
    const float* texels;
    FloatPart size[3];
    IntPart last[3];    // texel
    IntPart row, slice; // floats
};
inline Texture texture_of(const Resource& resource) {
    const Image& image = resource.image;
    Texture out{&resource, image.format == VK_FORMAT_R32_SFLOAT,
                false,     reinterpret_cast<const float*>(image.texels),
                {},        {},
                {},        {}};
    out.is_fast = out.is_float && resource.sampler.is_linear && resource.sampler.is_normalised &&
                  !resource.sampler.is_clamped_to_border && image.width >= 2 && !image.is_array;
    const uint32_t size[3] = {image.width, image.height, image.depth};
    for (int axis = 0; axis < 3; ++axis) {
        out.size[axis] = FloatPart{} + static_cast<float>(size[axis]);
        out.last[axis] = IntPart{} + static_cast<int32_t>(size[axis] - 1);
    }
    out.row = IntPart{} + static_cast<int32_t>(image.row_bytes / 4);
    out.slice = IntPart{} + static_cast<int32_t>(image.slice_bytes / 4);
    return out;
}

#if defined(__AVX512F__)
LANES_INLINE IntPart part_clamp(IntPart a, IntPart high) {
    return (IntPart)_mm512_min_epi32(_mm512_max_epi32((__m512i)a, _mm512_setzero_si512()),
                                     (__m512i)high);
}
LANES_INLINE FloatPart part_where(IntPart a, IntPart b, FloatPart equal, FloatPart else_) {
    return (FloatPart)_mm512_mask_blend_ps(_mm512_cmpeq_epi32_mask((__m512i)a, (__m512i)b),
                                           (__m512)else_, (__m512)equal);
}
// The floats at `at` and behind it.
LANES_INLINE void part_pair(const float* texels, IntPart at, FloatPart& first, FloatPart& second) {
    const __m256i low = _mm512_castsi512_si256((__m512i)at);
    const __m256i high = _mm512_extracti64x4_epi64((__m512i)at, 1);
    const __m512 a = _mm512_castsi512_ps(_mm512_i32gather_epi64(low, texels, 4));
    const __m512 b = _mm512_castsi512_ps(_mm512_i32gather_epi64(high, texels, 4));
    const __m512i even =
        _mm512_set_epi32(30, 28, 26, 24, 22, 20, 18, 16, 14, 12, 10, 8, 6, 4, 2, 0);
    first = (FloatPart)_mm512_permutex2var_ps(a, even, b);
    second = (FloatPart)_mm512_permutex2var_ps(a, _mm512_or_si512(even, _mm512_set1_epi32(1)), b);
}
#else
LANES_INLINE IntPart part_clamp(IntPart a, IntPart high) {
    a = a < 0 ? IntPart{} : a;
    return a > high ? high : a;
}
LANES_INLINE FloatPart part_where(IntPart a, IntPart b, FloatPart equal, FloatPart else_) {
    return a == b ? equal : else_;
}
#if defined(__AVX2__)
LANES_INLINE void part_pair(const float* texels, IntPart at, FloatPart& first, FloatPart& second) {
    const auto* base = reinterpret_cast<const long long*>(texels);
    const __m256 a = (__m256)_mm256_i32gather_epi64(base, _mm256_castsi256_si128((__m256i)at), 4);
    const __m256 b =
        (__m256)_mm256_i32gather_epi64(base, _mm256_extracti128_si256((__m256i)at, 1), 4);
    const auto sorted = [](__m256 x) { // quarters in the order of `at`
        return (FloatPart)_mm256_permute4x64_pd((__m256d)x, 0xd8);
    };
    first = sorted(_mm256_shuffle_ps(a, b, 0x88));
    second = sorted(_mm256_shuffle_ps(a, b, 0xdd));
}
#else
LANES_INLINE void part_pair(const float* texels, IntPart at, FloatPart& first, FloatPart& second) {
    for (int k = 0; k < kNative; ++k) {
        first[k] = texels[at[k]];
        second[k] = texels[at[k] + 1];
    }
}
#endif
#endif

// Linear between the eight texels about a place, each axis after the other. Beyond the image both
// texels of a pair are the one at its edge, so that a NaN behind it does not count.
[[gnu::noinline]] inline FloatPart sample_fast(const Texture& t, FloatPart x, FloatPart y,
                                               FloatPart z) {
    const FloatPart tx = x * t.size[0] - 0.5f, ty = y * t.size[1] - 0.5f, tz = z * t.size[2] - 0.5f;
    const FloatPart fx = part_floor(tx), fy = part_floor(ty), fz = part_floor(tz);
    const FloatPart wx = tx - fx, wy = ty - fy, wz = tz - fz;
    const IntPart ix = part_truncate(fx), iy = part_truncate(fy), iz = part_truncate(fz);
    const IntPart x0 = part_clamp(ix, t.last[0] - 1);
    const IntPart y0 = part_clamp(iy, t.last[1]) * t.row;
    const IntPart y1 = part_clamp(iy + 1, t.last[1]) * t.row;
    const IntPart z0 = part_clamp(iz, t.last[2]) * t.slice;
    const IntPart z1 = part_clamp(iz + 1, t.last[2]) * t.slice;
    const IntPart right = part_clamp(ix, t.last[0]), left = part_clamp(ix + 1, t.last[0]);
    const auto along_x = [&](IntPart row) {
        FloatPart a, b;
        part_pair(t.texels, row + x0, a, b);
        const FloatPart first = part_where(right, t.last[0], b, a);
        const FloatPart second = part_where(left, IntPart{}, a, b);
        return first + wx * (second - first);
    };
    const FloatPart a = along_x(z0 + y0), b = along_x(z0 + y1);
    const FloatPart c = along_x(z1 + y0), d = along_x(z1 + y1);
    const FloatPart front = a + wy * (b - a), back = c + wy * (d - c);
    return front + wz * (back - front);
}

template <class T>
struct Channels {
    T c[4];
};

// Kinds of results: F or U. kOne: only the first channel is asked for.
template <bool kOne>
LANES_INLINE Channels<U> sample(const Texture& t, int dimensions, F x, F y, F z, B mask) {
    Channels<U> out;
    if (kOne && dimensions == 3 && t.is_fast) [[likely]] {
        EACH_PART out.c[0].p[i] = (UintPart)sample_fast(t, x.p[i], y.p[i], z.p[i]);
        return out;
    }
    for (int i = 0; i < kParts; ++i) {
        const FloatPart at[3] = {x.p[i], y.p[i], z.p[i]};
        UintPart values[4];
        level::sample_part(t.bound->image, t.bound->sampler, dimensions, at, mask.p[i], values);
        for (int c = 0; c < (kOne ? 1 : 4); ++c)
            out.c[c].p[i] = values[c];
    }
    return out;
}
template <bool kOne>
LANES_INLINE Channels<U> fetch(const Texture& t, U x, U y, U z, B mask) {
    Channels<U> out;
    for (int i = 0; i < kParts; ++i) {
        UintPart values[4];
        level::fetch_part(t.bound->image, {(IntPart)x.p[i], (IntPart)y.p[i], (IntPart)z.p[i]},
                          mask.p[i], values);
        for (int c = 0; c < (kOne ? 1 : 4); ++c)
            out.c[c].p[i] = values[c];
    }
    return out;
}
LANES_INLINE void store(const Texture& t, U x, U y, U z, U r, U g, U b, U a, B mask) {
    for (int i = 0; i < kParts; ++i) {
        const UintPart values[4] = {r.p[i], g.p[i], b.p[i], a.p[i]};
        level::store_part(t.bound->image, {(IntPart)x.p[i], (IntPart)y.p[i], (IntPart)z.p[i]},
                          mask.p[i], values);
    }
}
LANES_INLINE uint32_t size_of(const Texture& t, int axis) {
    const Image& image = t.bound->image;
    return axis == 0 ? image.width : axis == 1 ? image.height : image.depth;
}

} // namespace
} // namespace palpate::native
