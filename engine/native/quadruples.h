#pragma once

// Texels of four numbers, lane by lane where that takes fewer loads than gathers do. With AVX2 and
// AVX-512; included by images.cpp.
#include "engine/native/lanes.h"

#if defined(__AVX2__)
namespace palpate::native::PALPATE_LEVEL {
namespace {

// Four floats a lane, of which lane 4 b + k has block b of of_quarter[k], as four channels.
#if defined(__AVX512F__)
constexpr int kBlocks = 4;
void to_channels(const __m512* of_quarter, UintPart* out) {
    const __m512 a = _mm512_unpacklo_ps(of_quarter[0], of_quarter[1]);
    const __m512 b = _mm512_unpackhi_ps(of_quarter[0], of_quarter[1]);
    const __m512 c = _mm512_unpacklo_ps(of_quarter[2], of_quarter[3]);
    const __m512 d = _mm512_unpackhi_ps(of_quarter[2], of_quarter[3]);
    out[0] = (UintPart)_mm512_shuffle_ps(a, c, 0x44);
    out[1] = (UintPart)_mm512_shuffle_ps(a, c, 0xee);
    out[2] = (UintPart)_mm512_shuffle_ps(b, d, 0x44);
    out[3] = (UintPart)_mm512_shuffle_ps(b, d, 0xee);
}
#else
constexpr int kBlocks = 2;
void to_channels(const __m256* of_quarter, UintPart* out) {
    const __m256 a = _mm256_unpacklo_ps(of_quarter[0], of_quarter[1]);
    const __m256 b = _mm256_unpackhi_ps(of_quarter[0], of_quarter[1]);
    const __m256 c = _mm256_unpacklo_ps(of_quarter[2], of_quarter[3]);
    const __m256 d = _mm256_unpackhi_ps(of_quarter[2], of_quarter[3]);
    out[0] = (UintPart)_mm256_shuffle_ps(a, c, 0x44);
    out[1] = (UintPart)_mm256_shuffle_ps(a, c, 0xee);
    out[2] = (UintPart)_mm256_shuffle_ps(b, d, 0x44);
    out[3] = (UintPart)_mm256_shuffle_ps(b, d, 0xee);
}
#endif

// Texels of four floats at their indices: a load a lane, where gathers take four.
void load_quadruples(const Image& image, UintPart index, MaskPart mask, UintPart* out) {
    B kept(false);
    kept.p[0] = mask;
    U safe(0u);
    safe.p[0] = index;
    safe = select(kept, safe, U(0u));
    alignas(64) uint32_t at[kNative];
    __builtin_memcpy(at, &safe.p[0], sizeof at);
    const auto texel = [&](int lane) {
        return reinterpret_cast<const float*>(image.texels) + size_t{at[lane]} * 4;
    };
#if defined(__AVX512F__)
    __m512 of_quarter[4];
    for (int k = 0; k < 4; ++k) {
        const __m256 low = _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(texel(k))),
                                                _mm_loadu_ps(texel(k + 4)), 1);
        const __m256 high = _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(texel(k + 8))),
                                                 _mm_loadu_ps(texel(k + 12)), 1);
        of_quarter[k] = _mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
    }
#else
    __m256 of_quarter[4];
    for (int k = 0; k < 4; ++k)
        of_quarter[k] = _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(texel(k))),
                                             _mm_loadu_ps(texel(k + 4)), 1);
#endif
    to_channels(of_quarter, out);
    for (int c = 0; c < 4; ++c) {
        safe.p[0] = out[c];
        out[c] = select(kept, safe, U(0u)).p[0];
    }
}

// Linear between the eight texels of four halves about a place: lane by lane, for the two texels of
// a row lie side by side. The sums are those of the general case.
bool is_half_volume(const Image& image, const Sampler& sampler, int dimensions) {
    return image.format == VK_FORMAT_R16G16B16A16_SFLOAT && dimensions == 3 && !image.is_array &&
           sampler.is_linear && sampler.is_normalised && !sampler.is_clamped_to_border &&
           image.width >= 2;
}

void sample_half_volume(const Image& image, const FloatPart* at, MaskPart mask, UintPart* out) {
    const auto clamped = [](IntPart a, uint32_t size) {
        return part_clamp(a, IntPart{} + (static_cast<int32_t>(size) - 1));
    };
    const uint32_t size[3] = {image.width, image.height, image.depth};
    alignas(64) float weight[3][kNative];
    alignas(64) int32_t first[3][kNative], second[3][kNative], x[kNative];
    for (int axis = 0; axis < 3; ++axis) {
        const FloatPart scaled =
            part_fmin(part_fmax(at[axis] * static_cast<float>(size[axis]), FloatPart{} - 1e9f),
                      FloatPart{} + 1e9f);
        const FloatPart t = scaled - 0.5f, low = part_floor(t), rest = t - low;
        const IntPart a = part_truncate(low), last = clamped(a, size[axis]),
                      next = clamped(a + 1, size[axis]);
        __builtin_memcpy(weight[axis], &rest, sizeof rest);
        __builtin_memcpy(first[axis], &last, sizeof last);
        __builtin_memcpy(second[axis], &next, sizeof next);
        if (axis == 0) {
            const IntPart pair = clamped(a, size[0] - 1);
            __builtin_memcpy(x, &pair, sizeof pair);
        }
    }
    alignas(64) float found[4][kBlocks][4] = {};
    for (uint32_t left = bits(mask); left != 0; left &= left - 1) {
        const int lane = __builtin_ctz(left);
        const std::byte* column = image.texels + int64_t{x[lane]} * 8;
        const auto row = [&](int32_t y, int32_t z) {
            return _mm_loadu_si128(reinterpret_cast<const __m128i*>(column + y * image.row_bytes +
                                                                    z * image.slice_bytes));
        };
        const __m256 front = _mm256_cvtph_ps(row(first[1][lane], first[2][lane]));
        const __m256 back = _mm256_cvtph_ps(row(first[1][lane], second[2][lane]));
        const __m256 front_next = _mm256_cvtph_ps(row(second[1][lane], first[2][lane]));
        const __m256 back_next = _mm256_cvtph_ps(row(second[1][lane], second[2][lane]));
        // Beyond the image both texels of a row are the one at its edge.
        const auto along_x = [&](__m256 a, __m256 b) {
            __m256 low = _mm256_permute2f128_ps(a, b, 0x20);
            __m256 high = _mm256_permute2f128_ps(a, b, 0x31);
            if (first[0][lane] == second[0][lane]) [[unlikely]]
                (first[0][lane] == x[lane] ? high : low) = first[0][lane] == x[lane] ? low : high;
            return _mm256_add_ps(
                low, _mm256_mul_ps(_mm256_set1_ps(weight[0][lane]), _mm256_sub_ps(high, low)));
        };
        const __m256 a = along_x(front, back), b = along_x(front_next, back_next);
        const __m256 across =
            _mm256_add_ps(a, _mm256_mul_ps(_mm256_set1_ps(weight[1][lane]), _mm256_sub_ps(b, a)));
        const __m128 near = _mm256_castps256_ps128(across);
        const __m128 far = _mm256_extractf128_ps(across, 1);
        _mm_store_ps(
            found[lane % 4][lane / 4],
            _mm_add_ps(near, _mm_mul_ps(_mm_set1_ps(weight[2][lane]), _mm_sub_ps(far, near))));
    }
#if defined(__AVX512F__)
    const __m512 of_quarter[4] = {_mm512_load_ps(found[0]), _mm512_load_ps(found[1]),
                                  _mm512_load_ps(found[2]), _mm512_load_ps(found[3])};
#else
    const __m256 of_quarter[4] = {_mm256_load_ps(found[0][0]), _mm256_load_ps(found[1][0]),
                                  _mm256_load_ps(found[2][0]), _mm256_load_ps(found[3][0])};
#endif
    to_channels(of_quarter, out);
}

} // namespace
} // namespace palpate::native::PALPATE_LEVEL
#endif
