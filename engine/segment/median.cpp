#include "engine/segment/median.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "engine/base/clones.h"
#include "engine/segment/rank_window.h"
#include "engine/volume/box.h"

namespace palpate {

namespace {

// 32 bytes of samples.
template <class T>
struct LanesOf {
    using Type [[gnu::vector_size(32)]] = T;
};
template <class T>
using Lanes = typename LanesOf<T>::Type;

template <class V>
[[gnu::always_inline]] inline void sort_two(V& low, V& high) {
    const V less = low < high ? low : high;
    high = low < high ? high : low;
    low = less;
}

// Moves the least of kCount values to the front and the greatest to the end.
template <int kCount, class V>
[[gnu::always_inline]] inline void extremes(V* v) {
    for (int i = 0; i < kCount / 2; ++i)
        sort_two(v[i], v[kCount - 1 - i]);
    for (int i = 1; i < (kCount + 1) / 2; ++i)
        sort_two(v[0], v[i]);
    for (int i = kCount / 2; i < kCount - 1; ++i)
        sort_two(v[i], v[kCount - 1]);
}

// The median of kAll values: the least and the greatest of just over half of them cannot be it, so
// they give way to one more, until three are left.
template <int kCount, int kAll, class V>
[[gnu::always_inline]] inline V median_from(V* v, const V* more) {
    extremes<kCount>(v);
    if constexpr (kCount == 3) {
        return v[1];
    } else {
        v[0] = more[0];
        return median_from<kCount - 1, kAll>(v, more + 1);
    }
}

// A row of 32 medians. `in` points to the first sample, neighbours lie at `offsets` from it.
template <int kAll, class T>
[[gnu::always_inline]] inline void network_row(const T* in, const std::ptrdiff_t* offsets, T* out) {
    using V = Lanes<T>;
    constexpr int kLanes = int(32 / sizeof(T));
    for (int x = 0; x < int(kBrickSide); x += kLanes) {
        V v[kAll];
        for (int i = 0; i < kAll; ++i)
            std::memcpy(&v[i], in + x + offsets[i], sizeof(V));
        const V middle = median_from<kAll / 2 + 2, kAll>(v, v + kAll / 2 + 2);
        std::memcpy(out + x, &middle, sizeof(V));
    }
}

template <class T>
struct BoxOf {
    glm::ivec3 size{};
    const T* samples;
    glm::ivec3 radius;
    int planes; // of the result

    const T* row(int y, int z) const {
        return samples + radius.x +
               size_t(size.x) * (size_t(y + radius.y) + size_t(size.y) * size_t(z + radius.z));
    }
};

template <int kAll, class T>
[[gnu::always_inline]] inline void networks(const BoxOf<T>& box, const std::ptrdiff_t* offsets,
                                            T* out) {
    for (int z = 0; z < box.planes; ++z)
        for (int y = 0; y < int(kBrickSide); ++y)
            network_row<kAll>(box.row(y, z), offsets,
                              out + kBrickSide * (uint32_t(y) + kBrickSide * uint32_t(z)));
}

#define PALPATE_NETWORKS(T)                                                                     \
    PALPATE_CLONES void median_3(const BoxOf<T>& box, const std::ptrdiff_t* offsets, T* out) {  \
        networks<3>(box, offsets, out);                                                         \
    }                                                                                           \
    PALPATE_CLONES void median_9(const BoxOf<T>& box, const std::ptrdiff_t* offsets, T* out) {  \
        networks<9>(box, offsets, out);                                                         \
    }                                                                                           \
    PALPATE_CLONES void median_27(const BoxOf<T>& box, const std::ptrdiff_t* offsets, T* out) { \
        networks<27>(box, offsets, out);                                                        \
    }
PALPATE_NETWORKS(uint8_t)
PALPATE_NETWORKS(int8_t)
PALPATE_NETWORKS(uint16_t)
PALPATE_NETWORKS(int16_t)
PALPATE_NETWORKS(float)
#undef PALPATE_NETWORKS

template <class T>
BrickPtr median_brick(const Volume& volume, glm::ivec3 radius, glm::uvec3 at) {
    if (const std::optional<float> constant = constant_around(volume, at, radius))
        return constant_brick(volume.type(), *constant);
    const glm::uvec3 valid = volume.valid_in_brick(at);
    const glm::ivec3 first = glm::ivec3(at * kBrickSide) - radius;
    const glm::ivec3 size = glm::ivec3(kBrickSide, kBrickSide, valid.z) + 2 * radius;
    thread_local std::vector<T> samples;
    thread_local std::vector<T> made;
    samples.resize(size_t(size.x) * size_t(size.y) * size_t(size.z));
    made.resize(kBrickSamples);
    read_box(volume, first, size, packed(glm::uvec3(size)), samples.data());
    const BoxOf<T> box{size, samples.data(), radius, int(valid.z)};
    bool has_all = true;
    if constexpr (std::is_floating_point_v<T>)
        has_all = volume.no_data_count() == 0 ||
                  std::none_of(samples.begin(), samples.end(), [](T v) { return std::isnan(v); });
    const glm::ivec3 sides = 2 * radius + 1;
    const int count = sides.x * sides.y * sides.z;
    if (has_all && (count == 3 || count == 9 || count == 27)) {
        std::array<std::ptrdiff_t, 27> offsets{};
        size_t i = 0;
        for (int z = -radius.z; z <= radius.z; ++z)
            for (int y = -radius.y; y <= radius.y; ++y)
                for (int x = -radius.x; x <= radius.x; ++x)
                    offsets[i++] = x + std::ptrdiff_t{size.x} * (y + std::ptrdiff_t{size.y} * z);
        (count == 3   ? static_cast<void (*)(const BoxOf<T>&, const std::ptrdiff_t*, T*)>(median_3)
         : count == 9 ? static_cast<void (*)(const BoxOf<T>&, const std::ptrdiff_t*, T*)>(median_9)
                      : static_cast<void (*)(const BoxOf<T>&, const std::ptrdiff_t*, T*)>(
                            median_27))(box, offsets.data(), made.data());
    } else {
        thread_local RankWindow<T> window;
        window.medians(samples, size, radius, valid, made);
    }
    return Brick::make(std::span<const T>(made), valid);
}

} // namespace

Result<MedianOptions> median_of_mm(const Grid& grid, double radius_mm) {
    const glm::dvec3 samples = radius_mm / spacing_mm(grid) + 1e-6;
    if (!(radius_mm >= 0.0) ||
        glm::any(glm::greaterThanEqual(samples, glm::dvec3(kLargestMedian + 1))))
        return fail("radius: expected 0 mm or more and at most {} samples to each side, found {:g}",
                    kLargestMedian, radius_mm);
    return MedianOptions{glm::max(glm::ivec3(samples), glm::ivec3(1))};
}

Result<BrickMaker> median_bricks(const Volume& volume, const MedianOptions& options) {
    const glm::ivec3 radius = options.radius_samples;
    if (glm::any(glm::lessThan(radius, glm::ivec3(0))) ||
        glm::any(glm::greaterThan(radius, glm::ivec3(kLargestMedian))))
        return fail("radius: expected 0 .. {} samples on each axis, found {}, {}, {}",
                    kLargestMedian, radius.x, radius.y, radius.z);
    return BrickMaker{volume.grid(), volume.type(), [volume, radius](glm::uvec3 at) {
                          return visit_scalar(volume.type(), [&](auto t) {
                              return median_brick<decltype(t)>(volume, radius, at);
                          });
                      }};
}

Result<Volume> median(const Volume& volume, const MedianOptions& options, const Task& task) {
    PALPATE_TRY(const BrickMaker maker, median_bricks(volume, options));
    return make_bricks(maker, task);
}

} // namespace palpate
