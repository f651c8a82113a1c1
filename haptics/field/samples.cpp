#include "haptics/field/samples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "haptics/field/four.h"

namespace palpate::haptics {

namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

bool is_inside(const Volume& volume, glm::ivec3 index) {
    const glm::uvec3 u(index), size = volume.size(); // negative ones become large
    return u.x < size.x && u.y < size.y && u.z < size.z;
}

template <class T>
float float_of(T sample, float missing) {
    const auto value = static_cast<float>(sample);
    return value == value ? value : missing;
}

// Four at a time: compilers do it for long rows only.
template <class T>
void copy_row(const T* from, int count, float missing, float* to) {
    typedef T FourOfT __attribute__((vector_size(4 * sizeof(T)))); // `using` drops the attribute
    const Four missing_four{missing, missing, missing, missing};
    int x = 0;
    for (; x + 4 <= count; x += 4) {
        FourOfT samples;
        std::memcpy(&samples, from + x, sizeof samples);
        Four values = __builtin_convertvector(samples, Four);
        if constexpr (std::is_floating_point_v<T>)
            values = values == values ? values : missing_four;
        store(to + x, values);
    }
    for (; x < count; ++x)
        to[x] = float_of(from[x], missing);
}

} // namespace

float resident_sample(const Volume& volume, glm::ivec3 index) {
    if (!is_inside(volume, index))
        return kNaN;
    const glm::uvec3 u(index);
    const Brick& brick = volume.brick(u / kBrickSide);
    return brick.is_in_source() ? kNaN : brick.value(offset_in_brick(u % kBrickSide));
}

double resident_trilinear(const Volume& volume, glm::dvec3 index) {
    glm::ivec3 low{};
    glm::dvec3 f{};
    for (int axis = 0; axis < 3; ++axis) {
        const double last = static_cast<double>(volume.size()[axis]) - 1.0;
        if (!(index[axis] >= 0.0 && index[axis] <= last))
            return kNaN;
        const double floor = std::min(std::floor(index[axis]), std::max(last - 1.0, 0.0));
        low[axis] = static_cast<int>(floor);
        f[axis] = index[axis] - floor;
    }
    const glm::ivec3 last = glm::ivec3(volume.size()) - 1;
    std::array<double, 8> c{};
    const glm::uvec3 first(low), local = first % kBrickSide;
    const Brick& brick = volume.brick(first / kBrickSide);
    if (local.x + 1 < kBrickSide && local.y + 1 < kBrickSide && local.z + 1 < kBrickSide) {
        // All corners lie in one brick (whose padding repeats the last sample).
        if (brick.is_in_source())
            return kNaN;
        if (brick.is_constant())
            return brick.value(0);
        const uint32_t at = offset_in_brick(local);
        for (uint32_t i = 0; i < 8; ++i)
            c[i] = brick.value(at + (i & 1) + kBrickSide * ((i >> 1 & 1) + kBrickSide * (i >> 2)));
    } else {
        for (int i = 0; i < 8; ++i)
            c[static_cast<size_t>(i)] = resident_sample(
                volume, glm::min(low + glm::ivec3(i & 1, i >> 1 & 1, i >> 2), last));
    }
    const auto lerp = [](double a, double b, double t) { return a + t * (b - a); };
    return lerp(lerp(lerp(c[0], c[1], f.x), lerp(c[2], c[3], f.x), f.y),
                lerp(lerp(c[4], c[5], f.x), lerp(c[6], c[7], f.x), f.y), f.z);
}

glm::dvec3 resident_gradient(const Volume& volume, glm::dvec3 index) {
    const glm::dvec3 last = glm::dvec3(volume.size()) - 1.0;
    glm::dvec3 gradient{};
    for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 step{};
        step[axis] = 1.0;
        gradient[axis] =
            0.5 * (resident_trilinear(volume, glm::clamp(index + step, glm::dvec3(0.0), last)) -
                   resident_trilinear(volume, glm::clamp(index - step, glm::dvec3(0.0), last)));
    }
    return gradient;
}

bool copy_resident(const Volume& volume, glm::ivec3 start, glm::ivec3 size, float missing,
                   float* out) {
    const glm::ivec3 side(kBrickSide);
    const glm::ivec3 low = glm::max(start, glm::ivec3(0));
    const glm::ivec3 high = glm::min(start + size, glm::ivec3(volume.size()));
    if (low != start || high != start + size)
        std::fill(out, out + size_t(size.x) * size_t(size.y) * size_t(size.z), missing);
    if (glm::any(glm::lessThanEqual(high, low)))
        return false;
    bool lacks_brick = false;
    const glm::ivec3 first = low / side, last = (high - 1) / side;
    for (int bz = first.z; bz <= last.z; ++bz)
        for (int by = first.y; by <= last.y; ++by)
            for (int bx = first.x; bx <= last.x; ++bx) {
                const glm::ivec3 position(bx, by, bz);
                const Brick& brick = volume.brick(glm::uvec3(position));
                const glm::ivec3 from = glm::max(low, position * side);
                const glm::ivec3 to = glm::min(high, (position + 1) * side);
                if (brick.is_in_source()) {
                    lacks_brick = true;
                    for (int z = from.z; z < to.z; ++z)
                        for (int y = from.y; y < to.y; ++y)
                            std::fill_n(out + (from.x - start.x) +
                                            size_t(size.x) * (size_t(y - start.y) +
                                                              size_t(size.y) * size_t(z - start.z)),
                                        to.x - from.x, missing);
                    continue;
                }
                const Brick::Pinned pinned = brick.pin();
                visit_scalar(brick.type(), [&](auto t) {
                    using T = decltype(t);
                    const auto* samples = reinterpret_cast<const T*>(pinned.bytes);
                    const int count = to.x - from.x;
                    for (int z = from.z; z < to.z; ++z)
                        for (int y = from.y; y < to.y; ++y) {
                            float* at = out + (from.x - start.x) +
                                        size_t(size.x) * (size_t(y - start.y) +
                                                          size_t(size.y) * size_t(z - start.z));
                            if (brick.is_constant())
                                std::fill_n(at, count, float_of(samples[0], missing));
                            else
                                copy_row(samples + offset_in_brick(
                                                       glm::uvec3(glm::ivec3(from.x, y, z) % side)),
                                         count, missing, at);
                        }
                });
            }
    return lacks_brick;
}

namespace {

template <class T>
bool any_nan(const Brick& brick, glm::ivec3 low, glm::ivec3 high) {
    if constexpr (std::is_floating_point_v<T>) { // whole numbers have no NaN
        if (brick.is_constant())
            return true;
        const Brick::Pinned pinned = brick.pin();
        const auto* samples = reinterpret_cast<const T*>(pinned.bytes);
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y)
                for (int x = low.x; x <= high.x; ++x)
                    if (const T sample = samples[offset_in_brick(glm::uvec3(x, y, z) % kBrickSide)];
                        sample != sample)
                        return true;
    }
    return false;
}

bool lacks(const Volume& volume, glm::ivec3 low, glm::ivec3 high, bool is_missing_lacking) {
    low = glm::max(low, glm::ivec3(0));
    high = glm::min(high, glm::ivec3(volume.size()) - 1);
    if (glm::any(glm::lessThan(high, low)))
        return false;
    const int side = kBrickSide;
    const glm::ivec3 first = low / side, last = high / side;
    for (int z = first.z; z <= last.z; ++z)
        for (int y = first.y; y <= last.y; ++y)
            for (int x = first.x; x <= last.x; ++x) {
                const glm::ivec3 at(x, y, z);
                const Brick& brick = volume.brick(glm::uvec3(at));
                const bool has_gaps = brick.no_data_count() > 0;
                if (brick.is_in_source()
                        ? has_gaps || is_missing_lacking
                        : has_gaps && visit_scalar(brick.type(), [&](auto t) {
                              return any_nan<decltype(t)>(brick, glm::max(low, side * at),
                                                          glm::min(high, side * (at + 1) - 1));
                          }))
                    return true;
            }
    return false;
}

} // namespace

bool lacks_data(const Volume& volume, glm::ivec3 low, glm::ivec3 high) {
    return lacks(volume, low, high, true);
}
bool has_no_data(const Volume& volume, glm::ivec3 low, glm::ivec3 high) {
    return lacks(volume, low, high, false);
}

ValueRange range_about(const Volume& volume, glm::ivec3 low, glm::ivec3 high, bool& lacks_some) {
    lacks_some = volume.no_data_count() > 0 || glm::any(glm::lessThan(low, glm::ivec3(0))) ||
                 glm::any(glm::greaterThanEqual(high, glm::ivec3(volume.size())));
    low = glm::max(low, glm::ivec3(0));
    high = glm::min(high, glm::ivec3(volume.size()) - 1);
    if (glm::any(glm::lessThan(high, low)))
        return {};
    ValueRange range;
    const glm::ivec3 first = low / int(kBlockSide), last = high / int(kBlockSide);
    for (int z = first.z; z <= last.z; ++z)
        for (int y = first.y; y <= last.y; ++y)
            for (int x = first.x; x <= last.x; ++x) {
                const glm::uvec3 at = glm::uvec3(x, y, z) * kBlockSide;
                const Brick& brick = volume.brick(at / kBrickSide);
                range.include(brick.is_constant() ? brick.range()
                                                  : brick.block_range(block_of(at % kBrickSide)));
            }
    return range;
}

} // namespace palpate::haptics
