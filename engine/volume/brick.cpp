#include "engine/volume/brick.h"

#include <atomic>
#include <cmath>
#include <cstring>
#include <new>
#include <type_traits>

#include "engine/base/assert.h"

namespace palpate {

namespace {

constexpr std::align_val_t kAlignment{64};

// One bit pattern for "no data", so that equal bricks are equal bytes.
template <class T>
T canonical(T value) {
    if constexpr (std::is_floating_point_v<T>)
        return std::isfinite(value) ? value : std::numeric_limits<T>::quiet_NaN();
    else
        return value;
}

template <class T>
bool same_bits(T a, T b) {
    return std::memcmp(&a, &b, sizeof(T)) == 0;
}

template <class T>
void repeat_into_padding(T* samples, glm::uvec3 valid) {
    if (valid == glm::uvec3(kBrickSide))
        return;
    for (uint32_t z = 0; z < kBrickSide; ++z)
        for (uint32_t y = 0; y < kBrickSide; ++y) {
            const uint32_t row = offset_in_brick({0, y, z});
            const uint32_t from =
                offset_in_brick({0, std::min(y, valid.y - 1), std::min(z, valid.z - 1)});
            if (row != from)
                std::memcpy(samples + row, samples + from, valid.x * sizeof(T));
            std::fill(samples + row + valid.x, samples + row + kBrickSide,
                      samples[row + valid.x - 1]);
        }
}

} // namespace

void Brick::Free::operator()(std::byte* p) const {
    ::operator delete(p, kAlignment);
}

uint64_t Brick::next_stamp() {
    static std::atomic<uint64_t> next{1};
    return next.fetch_add(1, std::memory_order_relaxed);
}

template <class T>
std::shared_ptr<Brick> Brick::make_new(std::span<const T> samples, glm::uvec3 valid) {
    PALPATE_ASSERT(samples.size() == kBrickSamples || samples.size() == 1);
    auto brick = std::make_shared<Brick>();
    brick->type_ = scalar_type_of<T>;
    const auto store = [&](size_t count) {
        brick->samples_.reset(
            static_cast<std::byte*>(::operator new(count * sizeof(T), kAlignment)));
        return reinterpret_cast<T*>(brick->samples_.get());
    };
    const auto make_constant = [&](T value) {
        *store(1) = value;
        brick->stride_ = 0;
        brick->block_ranges_.reset();
        brick->range_ = {};
        brick->no_data_count_ = 0;
        if (value == value)
            brick->range_.include(static_cast<float>(value));
        else
            brick->no_data_count_ = valid.x * valid.y * valid.z;
        return brick;
    };
    if (samples.size() == 1)
        return make_constant(canonical(samples[0]));

    T* kept = store(kBrickSamples);
    std::transform(samples.begin(), samples.end(), kept, canonical<T>);
    repeat_into_padding(kept, valid);
    if (std::all_of(kept, kept + kBrickSamples, [&](T v) { return same_bits(v, kept[0]); }))
        return make_constant(T{kept[0]});

    brick->stride_ = 1;
    const auto blocks = std::make_shared<BlockRanges>();
    for (uint32_t z = 0; z < valid.z; ++z)
        for (uint32_t y = 0; y < valid.y; ++y)
            for (uint32_t x0 = 0; x0 < valid.x; x0 += kBlockSide) {
                ValueRange range;
                const T* row = kept + offset_in_brick({x0, y, z});
                for (uint32_t x = 0; x < std::min(kBlockSide, valid.x - x0); ++x) {
                    if (row[x] == row[x])
                        range.include(static_cast<float>(row[x]));
                    else
                        ++brick->no_data_count_;
                }
                (*blocks)[block_of({x0, y, z})].include(range);
            }
    for (const ValueRange& range : *blocks)
        brick->range_.include(range);
    brick->block_ranges_ = blocks;
    return brick;
}

template <class T>
BrickPtr Brick::make(std::span<const T> samples, glm::uvec3 valid) {
    return make_new(samples, valid);
}

template <class T>
BrickPtr Brick::make_after(const Brick& before, std::span<const T> samples, glm::uvec3 valid) {
    std::shared_ptr<Brick> brick = make_new(samples, valid);
    const uint64_t changed = differing_blocks(before, *brick);
    if (changed == 0)
        return nullptr;
    if (changed != ~uint64_t{0}) {
        const auto stamps = std::make_shared<BlockStamps>();
        for (uint32_t b = 0; b < kBlocksPerBrick; ++b)
            (*stamps)[b] = changed >> b & 1 ? brick->stamp_ : before.block_stamp(b);
        brick->block_stamps_ = stamps;
    }
    return brick;
}

template BrickPtr Brick::make(std::span<const uint8_t>, glm::uvec3);
template BrickPtr Brick::make(std::span<const int8_t>, glm::uvec3);
template BrickPtr Brick::make(std::span<const uint16_t>, glm::uvec3);
template BrickPtr Brick::make(std::span<const int16_t>, glm::uvec3);
template BrickPtr Brick::make(std::span<const float>, glm::uvec3);
template BrickPtr Brick::make_after(const Brick&, std::span<const uint8_t>, glm::uvec3);
template BrickPtr Brick::make_after(const Brick&, std::span<const int8_t>, glm::uvec3);
template BrickPtr Brick::make_after(const Brick&, std::span<const uint16_t>, glm::uvec3);
template BrickPtr Brick::make_after(const Brick&, std::span<const int16_t>, glm::uvec3);
template BrickPtr Brick::make_after(const Brick&, std::span<const float>, glm::uvec3);

BrickPtr Brick::in_source(std::shared_ptr<const BrickSource> source, uint64_t key, Known known) {
    PALPATE_ASSERT(source && known.block_ranges);
    auto brick = std::make_shared<Brick>();
    brick->type_ = known.type;
    brick->stride_ = 1;
    brick->no_data_count_ = known.no_data_count;
    for (const ValueRange& range : *known.block_ranges)
        brick->range_.include(range);
    brick->block_ranges_ = std::move(known.block_ranges);
    brick->source_ = std::move(source);
    brick->key_ = key;
    return brick;
}

float Brick::value(uint32_t offset) const {
    return value(pin(), offset);
}

float Brick::value(const Pinned& pinned, uint32_t offset) const {
    return visit_scalar(type_, [&](auto t) {
        const auto* samples = reinterpret_cast<const decltype(t)*>(pinned.bytes);
        return static_cast<float>(samples[stride_ * offset]);
    });
}

template <class T>
void Brick::read(std::span<T> out) const {
    PALPATE_ASSERT_CMP(out.size(), ==, size_t{kBrickSamples});
    visit_scalar(type_, [&](auto t) {
        const auto in = samples<decltype(t)>();
        if (is_constant())
            std::fill(out.begin(), out.end(), static_cast<T>(in[0]));
        else
            std::transform(in.begin(), in.end(), out.begin(),
                           [](auto v) { return static_cast<T>(v); });
    });
}

template void Brick::read(std::span<uint8_t>) const;
template void Brick::read(std::span<int8_t>) const;
template void Brick::read(std::span<uint16_t>) const;
template void Brick::read(std::span<int16_t>) const;
template void Brick::read(std::span<int32_t>) const;
template void Brick::read(std::span<float>) const;

size_t Brick::bytes() const {
    const size_t samples = source_ ? 0 : is_constant() ? 1 : kBrickSamples;
    return sizeof(Brick) + samples * bytes_per_sample(type_) +
           (block_ranges_ ? sizeof(*block_ranges_) : 0) +
           (block_stamps_ ? sizeof(*block_stamps_) : 0);
}

uint64_t differing_blocks(const Brick& a, const Brick& b) {
    PALPATE_ASSERT(a.type() == b.type());
    uint64_t mask = 0;
    for (uint32_t block = 0; block < kBlocksPerBrick; ++block)
        if (a.block_stamp(block) != b.block_stamp(block)) // and perhaps the same samples
            mask |= uint64_t{1} << block;
    if (mask == 0)
        return 0;
    return visit_scalar(a.type(), [&](auto t) {
        using T = decltype(t);
        const BrickSamples<T> samples_a = a.samples<T>(), samples_b = b.samples<T>();
        const T* pa = samples_a.data();
        const T* pb = samples_b.data();
        const auto same_row = [&](uint32_t start) {
            if (a.stride() == 1 && b.stride() == 1)
                return std::memcmp(pa + start, pb + start, kBlockSide * sizeof(T)) == 0;
            for (uint32_t i = start; i < start + kBlockSide; ++i)
                if (!same_bits(pa[a.stride() * i], pb[b.stride() * i]))
                    return false;
            return true;
        };
        const auto same_block = [&](glm::uvec3 low) {
            for (uint32_t z = low.z; z < low.z + kBlockSide; ++z)
                for (uint32_t y = low.y; y < low.y + kBlockSide; ++y)
                    if (!same_row(offset_in_brick({low.x, y, z})))
                        return false;
            return true;
        };
        for (uint32_t block = 0; block < kBlocksPerBrick; ++block) {
            const glm::uvec3 at(block % kBlocksPerSide, block / kBlocksPerSide % kBlocksPerSide,
                                block / (kBlocksPerSide * kBlocksPerSide));
            if ((mask >> block & 1) && same_block(at * kBlockSide))
                mask &= ~(uint64_t{1} << block);
        }
        return mask;
    });
}

} // namespace palpate
