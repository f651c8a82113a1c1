#include "engine/surface/sign_field.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "engine/base/assert.h"

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace palpate::block {

namespace {

static_assert(std::endian::native == std::endian::little, "eight blocks are read as one number");

constexpr int kBricks = static_cast<int>(kBrickSide);
constexpr int kBlocks = static_cast<int>(kBlocksPerSide);

int floor_divided(int a, int b) {
    return a >= 0 ? a / b : -((b - 1 - a) / b);
}

// Bit i: samples[i] >= level, for the 32 samples of a brick's row.
template <class T>
uint32_t inside_bits(const T* samples, T level) {
    uint32_t bits = 0;
#if defined(__SSE2__)
    const auto load = [&](int i) {
        return _mm_load_si128(reinterpret_cast<const __m128i*>(samples + i));
    };
    if constexpr (std::is_same_v<T, float>) {
        for (int i = 0; i < 32; i += 4)
            bits |= static_cast<uint32_t>(
                        _mm_movemask_ps(_mm_cmpge_ps(_mm_load_ps(samples + i), _mm_set1_ps(level))))
                    << i;
        return bits;
    } else if constexpr (sizeof(T) == 2) { // signed compare: unsigned is moved by half its range
        const __m128i move = _mm_set1_epi16(std::is_signed_v<T> ? 0 : INT16_MIN);
        const __m128i threshold = _mm_xor_si128(_mm_set1_epi16(static_cast<int16_t>(level)), move);
        for (int i = 0; i < 32; i += 16) {
            const __m128i a = _mm_cmplt_epi16(_mm_xor_si128(load(i), move), threshold);
            const __m128i b = _mm_cmplt_epi16(_mm_xor_si128(load(i + 8), move), threshold);
            bits |= static_cast<uint32_t>(_mm_movemask_epi8(_mm_packs_epi16(a, b))) << i;
        }
        return ~bits;
    } else {
        const __m128i move = _mm_set1_epi8(std::is_signed_v<T> ? 0 : INT8_MIN);
        const __m128i threshold = _mm_xor_si128(_mm_set1_epi8(static_cast<int8_t>(level)), move);
        for (int i = 0; i < 32; i += 16)
            bits |= static_cast<uint32_t>(
                        _mm_movemask_epi8(_mm_cmplt_epi8(_mm_xor_si128(load(i), move), threshold)))
                    << i;
        return ~bits;
    }
#else
    for (int i = 0; i < 32; ++i)
        bits |= static_cast<uint32_t>(samples[i] >= level) << i;
    return bits;
#endif
}

} // namespace

SignField::SignField(const Volume& volume, float iso, bool closed_at_border,
                     const std::stop_token& stop)
    : lead_(closed_at_border ? 1 : 0), bricks_(volume.brick_count()) {
    last_sample_ = glm::ivec3(volume.size()) - 1 + lead_;
    end_block_ = last_sample_ / kSide + 1;
    for (int a = 0; a < 3; ++a)
        end_brick_[a] = floor_divided(end_block_[a] - 1, kBlocks) + 1;
    // Whole bricks are written, eight bytes and rows 8 and 9 of a block are read.
    const glm::ivec3 blocks = glm::max(end_block_, bricks_ * kBlocks) + lead_;
    pitch_ = static_cast<size_t>(blocks.x) + 8;
    rows_ = static_cast<size_t>(blocks.y) * kSide + 2;
    bits_.resize(pitch_ * rows_ * (static_cast<size_t>(blocks.z) * kSide + 2));
    kinds_.resize(static_cast<size_t>(bricks_.x) * bricks_.y * bricks_.z);
    std::atomic<uint64_t> read = 0;
    visit_scalar(volume.type(), [&](auto t) {
        tbb::parallel_for(size_t{0}, kinds_.size(), [&](size_t i) {
            if (stop.stop_requested())
                return;
            const glm::uvec3 brick(i % bricks_.x, i / bricks_.x % bricks_.y,
                                   i / (static_cast<size_t>(bricks_.x) * bricks_.y));
            kinds_[i] = fill<decltype(t)>(volume, brick, iso);
            if (kinds_[i] == Kind::mixed)
                read.fetch_add(1, std::memory_order_relaxed);
        });
    });
    bricks_read_ = read;
}

template <class T>
SignField::Kind SignField::fill(const Volume& volume, glm::uvec3 position, float iso) {
    const Brick& brick = volume.brick(position);
    const bool gaps = brick.no_data_count() > 0;
    const auto all_inside = [&](ValueRange r) { return r.min >= iso && !r.empty() && !gaps; };
    const auto all_outside = [&](ValueRange r) { return r.empty() || !(r.max >= iso); };
    if (all_outside(brick.range()))
        return Kind::outside; // as the bits are
    const glm::ivec3 valid(volume.valid_in_brick(position));
    const uint32_t in_row = valid.x == kBricks ? ~0u : (1u << valid.x) - 1u;
    const glm::ivec3 first = glm::ivec3(position) * kBricks;
    const auto put = [&](int y, int z, uint32_t bits) {
        bits &= in_row;
        uint8_t* out = row(first.x / kSide, first.y + y, first.z + z);
        for (int b = 0; b < kBlocks; ++b)
            out[b] = static_cast<uint8_t>(bits >> (8 * b));
    };
    if (all_inside(brick.range())) {
        for (int z = 0; z < valid.z; ++z)
            for (int y = 0; y < valid.y; ++y)
                put(y, z, ~0u);
        return Kind::inside;
    }
    // A constant brick is on one side; what is left has kBrickSamples samples.
    T level{};
    if constexpr (std::is_same_v<T, float>) {
        level = iso;
    } else { // the least value that is inside; there is one, or the brick were outside
        level = static_cast<T>(
            std::max(std::ceil(double{iso}), double{std::numeric_limits<T>::lowest()}));
    }
    const BrickSamples<T> samples = brick.samples<T>();
    PALPATE_ASSERT_CMP(samples.size(), ==, kBrickSamples);
    for (int z0 = 0; z0 < valid.z; z0 += kSide)
        for (int y0 = 0; y0 < valid.y; y0 += kSide) {
            bool outside = true, inside = true;
            for (int x = 0; x < valid.x; x += kSide) {
                const ValueRange range =
                    brick.block_range(block_of(glm::uvec3(glm::ivec3(x, y0, z0))));
                outside = outside && all_outside(range);
                inside = inside && all_inside(range);
            }
            if (outside)
                continue;
            for (int z = z0; z < std::min(z0 + kSide, valid.z); ++z)
                for (int y = y0; y < std::min(y0 + kSide, valid.y); ++y)
                    put(y, z,
                        inside ? ~0u
                               : inside_bits(samples.data() + kBricks * (y + kBricks * z), level));
        }
    return Kind::mixed;
}

SignField::Kind SignField::kind_at(glm::ivec3 brick) const {
    if (glm::any(glm::lessThan(brick, glm::ivec3(0))) ||
        glm::any(glm::greaterThanEqual(brick, bricks_)))
        return Kind::outside;
    return kinds_[static_cast<size_t>(brick.x) +
                  static_cast<size_t>(bricks_.x) *
                      (static_cast<size_t>(brick.y) +
                       static_cast<size_t>(bricks_.y) * static_cast<size_t>(brick.z))];
}

uint64_t SignField::crossed_blocks(glm::ivec3 brick) const {
    // Beyond the volume and an open border there are no samples: a brick there tells nothing.
    const auto exists = [&](int a, int i) { return lead_ != 0 || i < bricks_[a]; };
    const Kind kind = kind_at(brick);
    bool uniform = kind != Kind::mixed;
    for (int n = 1; n < 8 && uniform; ++n) {
        const glm::ivec3 at = brick + glm::ivec3(n & 1, n >> 1 & 1, n >> 2);
        if (exists(0, at.x) && exists(1, at.y) && exists(2, at.z))
            uniform = kind_at(at) == kind;
    }
    if (uniform)
        return 0;
    uint64_t crossed = 0;
    const glm::ivec3 low = glm::max(brick * kBlocks, first_block());
    const glm::ivec3 high = glm::min((brick + 1) * kBlocks, end_block_);
    for (int bz = low.z; bz < high.z; ++bz)
        for (int by = low.y; by < high.y; ++by) {
            uint64_t any = 0, all = ~uint64_t{0};
            for (int z = bz * kSide; z <= std::min(bz * kSide + kSide, last_sample_.z); ++z)
                for (int y = by * kSide; y <= std::min(by * kSide + kSide, last_sample_.y); ++y) {
                    uint64_t bits;
                    std::memcpy(&bits, row(low.x, y, z), sizeof bits);
                    any |= bits;
                    all &= bits;
                }
            for (int bx = low.x; bx < high.x; ++bx, any >>= 8, all >>= 8)
                if ((any & 0x1ff) != 0 && (all & 0x1ff) != 0x1ff)
                    crossed |= uint64_t{1} << ((bx - brick.x * kBlocks) +
                                               kBlocks * ((by - brick.y * kBlocks) +
                                                          kBlocks * (bz - brick.z * kBlocks)));
        }
    return crossed;
}

Signs SignField::signs_of(glm::ivec3 block) const {
    Signs signs;
    for (int z = 0; z < 10; ++z)
        for (int y = 0; y < 10; ++y) {
            const uint8_t* bytes = row(block.x, block.y * kSide + y, block.z * kSide + z);
            signs.row[z][y] = static_cast<uint16_t>(bytes[0] | bytes[1] << 8);
        }
    return signs;
}

} // namespace palpate::block
