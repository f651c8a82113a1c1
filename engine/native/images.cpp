// The general cases of lanes_images.h. Compiled once for each instruction set.
#define PALPATE_LANES 0
#include "engine/native/lanes.h"
#include "engine/native/quadruples.h"

namespace palpate::native::PALPATE_LEVEL {

namespace {

U whole(UintPart part) {
    U out(0u);
    out.p[0] = part;
    return out;
}

// 32 bits at base + scale * index + shift of the lanes of a mask. Texels of less than four
// bytes read what lies behind them, too.
template <int kScale>
U gather(const Image& image, UintPart index, int shift, MaskPart mask) {
    U out(0u);
#if defined(__AVX512F__)
    out.p[0] = (UintPart)_mm512_mask_i32gather_epi32(_mm512_setzero_si512(), mask, (__m512i)index,
                                                     image.texels + shift, kScale);
#elif defined(__AVX2__)
    out.p[0] = (UintPart)_mm256_mask_i32gather_epi32(
        _mm256_setzero_si256(), reinterpret_cast<const int*>(image.texels + shift), (__m256i)index,
        (__m256i)mask, kScale);
#else
    for (int k = 0; k < kNative; ++k)
        if (mask[k]) {
            uint32_t word;
            __builtin_memcpy(&word, image.texels + shift + int64_t{kScale} * index[k], 4);
            out.p[0][k] = word;
        }
#endif
    return out;
}

F from_half(U h) {
    const U size = h & U(0x7fffu);
    const F value = as_float(shl(size, U(13u))) * F(5192296858534827628530496329220096.0f); // 2^112
    const F wide =
        select(ult(size, U(0x7c00u)), value, as_float(shl(size, U(13u)) | U(0x7f800000u)));
    return as_float(as_uint(wide) | shl(h & U(0x8000u), U(16u)));
}

// Rounded to the nearest, to even where two are as near.
uint32_t to_half(uint32_t bits) {
    const uint32_t sign = bits >> 16 & 0x8000u, size = bits & 0x7fffffffu;
    if (size > 0x7f800000u)
        return sign | 0x7e00u;
    if (size >= 0x477ff000u)
        return sign | 0x7c00u;
    if (size < 0x38800000u) // the halves below 2^-14 are whole numbers of 2^-24
        return sign | as_uint(as_float(size) + 0.5f) - 0x3f000000u;
    return sign | (size - 0x38000000u + 0xfffu + (size >> 13 & 1)) >> 13;
}

uint32_t to_unorm(uint32_t bits, float highest) {
    return static_cast<uint32_t>(
        __builtin_nearbyintf(fclamp(as_float(bits), 0.0f, 1.0f) * highest));
}
uint32_t to_snorm16(uint32_t bits) {
    return static_cast<uint32_t>(static_cast<int32_t>(
               __builtin_nearbyintf(fclamp(as_float(bits), -1.0f, 1.0f) * 32767.0f))) &
           0xffffu;
}

// The value at the index of a texel. Channels that the format lacks are 0, and 1 of alpha.
void decode(const Image& image, UintPart index, MaskPart mask, UintPart* out) {
    U c[4] = {U(0u), U(0u), U(0u), as_uint(F(1.0f))};
    const auto byte = [](U word, uint32_t from) { return shr(word, U(from)) & U(0xffu); };
    const auto unorm = [](U x, float highest) { return as_uint(from_int(x) * F(1.0f / highest)); };
    switch (image.format) {
        case VK_FORMAT_R8_UNORM:
            c[0] = unorm(byte(gather<1>(image, index, 0, mask), 0), 255.0f);
            break;
        case VK_FORMAT_R8_UINT:
            c[0] = byte(gather<1>(image, index, 0, mask), 0);
            c[3] = U(1u);
            break;
        case VK_FORMAT_R8G8_UNORM: {
            const U word = gather<2>(image, index, 0, mask);
            c[0] = unorm(byte(word, 0), 255.0f);
            c[1] = unorm(byte(word, 8), 255.0f);
            break;
        }
        case VK_FORMAT_R16_UNORM:
            c[0] = unorm(gather<2>(image, index, 0, mask) & U(0xffffu), 65535.0f);
            break;
        case VK_FORMAT_R16_SNORM: {
            const U word = sar(shl(gather<2>(image, index, 0, mask), U(16u)), U(16u));
            c[0] = as_uint(fmax(from_int(word) * F(1.0f / 32767.0f), F(-1.0f)));
            break;
        }
        case VK_FORMAT_R16_UINT:
            c[0] = gather<2>(image, index, 0, mask) & U(0xffffu);
            c[3] = U(1u);
            break;
        case VK_FORMAT_R16_SFLOAT:
            c[0] = as_uint(from_half(gather<2>(image, index, 0, mask) & U(0xffffu)));
            break;
        case VK_FORMAT_R8G8B8A8_UNORM:
        case VK_FORMAT_B8G8R8A8_UNORM: {
            const U word = gather<4>(image, index, 0, mask);
            const uint32_t red = image.format == VK_FORMAT_R8G8B8A8_UNORM ? 0 : 16;
            c[0] = unorm(byte(word, red), 255.0f);
            c[1] = unorm(byte(word, 8), 255.0f);
            c[2] = unorm(byte(word, 16 - red), 255.0f);
            c[3] = unorm(byte(word, 24), 255.0f);
            break;
        }
        case VK_FORMAT_R16G16_UNORM: {
            const U word = gather<4>(image, index, 0, mask);
            c[0] = unorm(word & U(0xffffu), 65535.0f);
            c[1] = unorm(shr(word, U(16u)), 65535.0f);
            break;
        }
        case VK_FORMAT_R16G16_SFLOAT: {
            const U word = gather<4>(image, index, 0, mask);
            c[0] = as_uint(from_half(word & U(0xffffu)));
            c[1] = as_uint(from_half(shr(word, U(16u))));
            break;
        }
        case VK_FORMAT_R32_UINT:
            c[3] = U(1u);
            [[fallthrough]];
        case VK_FORMAT_R32_SFLOAT:
            c[0] = gather<4>(image, index, 0, mask);
            break;
        case VK_FORMAT_R16G16B16A16_SFLOAT:
            for (int pair = 0; pair < 2; ++pair) {
                const U word = gather<8>(image, index, 4 * pair, mask);
                c[2 * pair] = as_uint(from_half(word & U(0xffffu)));
                c[2 * pair + 1] = as_uint(from_half(shr(word, U(16u))));
            }
            break;
        case VK_FORMAT_R32G32_UINT:
            c[3] = U(1u);
            [[fallthrough]];
        case VK_FORMAT_R32G32_SFLOAT:
            for (int i = 0; i < 2; ++i)
                c[i] = gather<8>(image, index, 4 * i, mask);
            break;
        case VK_FORMAT_R32G32B32A32_SFLOAT:
        case VK_FORMAT_R32G32B32A32_UINT:
#if defined(__AVX2__)
            return load_quadruples(image, index, mask, out);
#else
            for (int i = 0; i < 4; ++i)
                c[i] = gather<8>(image, index * 2u, 4 * i, mask);
            break;
#endif
        default:
            break;
    }
    for (int i = 0; i < 4; ++i)
        out[i] = c[i].p[0];
}

UintPart index_of(const Image& image, IntPart x, IntPart y, IntPart z) {
    const auto size = static_cast<int64_t>(texel_bytes(image.format));
    if (size == 0)
        return UintPart{};
    return (UintPart)(x + y * static_cast<int32_t>(image.row_bytes / size) +
                      z * static_cast<int32_t>(image.slice_bytes / size));
}

#if defined(__AVX512F__)
MaskPart within(IntPart a, uint32_t size) {
    return _mm512_cmplt_epu32_mask((__m512i)a, _mm512_set1_epi32(static_cast<int>(size)));
}
#else
MaskPart within(IntPart a, uint32_t size) {
    return (IntPart)((UintPart)a < size);
}
#endif

MaskPart both(MaskPart a, MaskPart b) {
    return static_cast<MaskPart>(a & b);
}

IntPart clamped(IntPart a, uint32_t size) {
    return part_clamp(a, IntPart{} + (static_cast<int32_t>(size) - 1));
}

void fetch_clamped(const Image& image, const Sampler& sampler, int dimensions, const Texel& at,
                   MaskPart mask, UintPart* out) {
    MaskPart inside = mask;
    if (sampler.is_clamped_to_border) {
        inside = both(inside, within(at.x, image.width));
        if (dimensions > 1)
            inside = both(inside, within(at.y, image.height));
        if (dimensions > 2)
            inside = both(inside, within(at.z, image.depth));
    }
    decode(image,
           index_of(image, clamped(at.x, image.width), clamped(at.y, image.height),
                    clamped(at.z, image.depth)),
           inside, out);
    if (sampler.is_clamped_to_border) {
        B kept(false);
        kept.p[0] = inside;
        for (int c = 0; c < 4; ++c)
            out[c] = select(kept, whole(out[c]), U(0u)).p[0];
    }
}

} // namespace

void fetch_part(const Image& image, const Texel& at, MaskPart mask, UintPart* out) {
    const MaskPart inside =
        both(both(both(mask, within(at.x, image.width)), within(at.y, image.height)),
             within(at.z, image.depth));
    decode(image, index_of(image, at.x, at.y, at.z), inside, out);
}

void store_part(const Image& image, const Texel& at, MaskPart mask, const UintPart* values) {
    B inside(false);
    inside.p[0] = both(both(both(mask, within(at.x, image.width)), within(at.y, image.height)),
                       within(at.z, image.depth));
    const uint32_t size = texel_bytes(image.format);
    each_lane(inside, [&](int lane) {
        std::byte* to = image.texels + int64_t{at.x[lane]} * size +
                        int64_t{at.y[lane]} * image.row_bytes +
                        int64_t{at.z[lane]} * image.slice_bytes;
        const uint32_t v[4] = {values[0][lane], values[1][lane], values[2][lane], values[3][lane]};
        uint32_t words[4] = {v[0], v[1], v[2], v[3]};
        switch (image.format) {
            case VK_FORMAT_R8_UNORM:
                words[0] = to_unorm(v[0], 255.0f);
                break;
            case VK_FORMAT_R8G8_UNORM:
                words[0] = to_unorm(v[0], 255.0f) | to_unorm(v[1], 255.0f) << 8;
                break;
            case VK_FORMAT_R16_UNORM:
                words[0] = to_unorm(v[0], 65535.0f);
                break;
            case VK_FORMAT_R16_SNORM:
                words[0] = to_snorm16(v[0]);
                break;
            case VK_FORMAT_R16_SFLOAT:
                words[0] = to_half(v[0]);
                break;
            case VK_FORMAT_R16G16_UNORM:
                words[0] = to_unorm(v[0], 65535.0f) | to_unorm(v[1], 65535.0f) << 16;
                break;
            case VK_FORMAT_R16G16_SFLOAT:
                words[0] = to_half(v[0]) | to_half(v[1]) << 16;
                break;
            case VK_FORMAT_R8G8B8A8_UNORM:
            case VK_FORMAT_B8G8R8A8_UNORM: {
                const int red = image.format == VK_FORMAT_R8G8B8A8_UNORM ? 0 : 2;
                words[0] = to_unorm(v[red], 255.0f) | to_unorm(v[1], 255.0f) << 8 |
                           to_unorm(v[2 - red], 255.0f) << 16 | to_unorm(v[3], 255.0f) << 24;
                break;
            }
            case VK_FORMAT_R16G16B16A16_SFLOAT:
                words[0] = to_half(v[0]) | to_half(v[1]) << 16;
                words[1] = to_half(v[2]) | to_half(v[3]) << 16;
                break;
            default: // integers and floats as they are
                break;
        }
        __builtin_memcpy(to, words, size);
    });
}

void sample_part(const Image& image, const Sampler& sampler, int dimensions, const FloatPart* at,
                 MaskPart mask, UintPart* out) {
#if defined(__AVX2__)
    if (is_half_volume(image, sampler, dimensions))
        return sample_half_volume(image, at, mask, out);
#endif
    const uint32_t size[3] = {image.width, image.height, image.depth};
    IntPart first[3] = {}, second[3] = {};
    FloatPart weight[3] = {};
    if (image.is_array) {
        const FloatPart rounded = part_floor(at[2] + 0.5f);
        const IntPart layer =
            clamped(part_truncate(part_fmin(rounded, FloatPart{} + 1e9f)), image.depth);
        first[2] = second[2] = layer;
    }
    for (int axis = 0; axis < dimensions; ++axis) {
        const float scale = sampler.is_normalised ? static_cast<float>(size[axis]) : 1.0f;
        // far places are as good as those just outside, and these are whole numbers of 32 bits
        const FloatPart scaled =
            part_fmin(part_fmax(at[axis] * scale, FloatPart{} - 1e9f), FloatPart{} + 1e9f);
        const FloatPart t = sampler.is_linear ? scaled - 0.5f : scaled;
        const FloatPart low = part_floor(t);
        weight[axis] = t - low;
        first[axis] = part_truncate(low);
        second[axis] = first[axis] + 1;
    }
    if (!sampler.is_linear) {
        fetch_clamped(image, sampler, dimensions, {first[0], first[1], first[2]}, mask, out);
        return;
    }
    FloatPart of_z[2][4];
    for (int z = 0; z < (dimensions > 2 ? 2 : 1); ++z) {
        FloatPart of_y[2][4];
        for (int y = 0; y < (dimensions > 1 ? 2 : 1); ++y) {
            const IntPart row = y == 0 ? first[1] : second[1],
                          slice = z == 0 ? first[2] : second[2];
            UintPart a[4], b[4];
            fetch_clamped(image, sampler, dimensions, {first[0], row, slice}, mask, a);
            fetch_clamped(image, sampler, dimensions, {second[0], row, slice}, mask, b);
            for (int c = 0; c < 4; ++c)
                of_y[y][c] = (FloatPart)a[c] + weight[0] * ((FloatPart)b[c] - (FloatPart)a[c]);
        }
        for (int c = 0; c < 4; ++c)
            of_z[z][c] =
                dimensions > 1 ? of_y[0][c] + weight[1] * (of_y[1][c] - of_y[0][c]) : of_y[0][c];
    }
    for (int c = 0; c < 4; ++c)
        out[c] = (UintPart)(dimensions > 2 ? of_z[0][c] + weight[2] * (of_z[1][c] - of_z[0][c])
                                           : of_z[0][c]);
}

} // namespace palpate::native::PALPATE_LEVEL
