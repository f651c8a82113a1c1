#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "engine/volume/brick.h"

namespace palpate {

// Medians of the boxes round the samples of a brick, by a histogram that slides along x and is
// counted in ranks: of whole numbers the distance from the least, of floats the place among the
// values in order. Samples that are NaN do not count, and have no median.
template <class T>
class RankWindow {
 public:
    // `samples`: a box of `size`, `radius` larger on each side than the brick's samples of which
    // `valid` are asked for. `out`: kBrickSamples; others are left alone.
    void medians(const std::vector<T>& samples, glm::ivec3 size, glm::ivec3 radius,
                 glm::uvec3 valid, std::vector<T>& out) {
        rank(samples);
        size_ = size;
        radius_ = radius;
        for (int z = 0; z < int(valid.z); ++z)
            for (int y = 0; y < int(valid.y); ++y) {
                for (int x = 0; x < 2 * radius.x; ++x)
                    put(x, y, z, +1);
                for (int x = 0; x < int(valid.x); ++x) {
                    put(x + 2 * radius.x, y, z, +1);
                    const size_t centre = place(x + radius.x, y + radius.y, z + radius.z);
                    const uint32_t to = offset_in_brick(glm::uvec3(x, y, z));
                    out[to] = ranks_[centre] == kNone ? samples[centre] : value_of(median());
                    put(x, y, z, -1);
                }
                for (int x = int(valid.x); x < int(valid.x) + 2 * radius.x; ++x)
                    put(x, y, z, -1);
            }
    }

 private:
    static constexpr uint32_t kNone = ~uint32_t{0};
    static constexpr uint32_t kCoarse = 256; // ranks

    size_t place(int x, int y, int z) const {
        return size_t(x) + size_t(size_.x) * (size_t(y) + size_t(size_.y) * size_t(z));
    }
    T value_of(uint32_t r) const {
        if constexpr (std::is_floating_point_v<T>)
            return sorted_[r];
        else
            return static_cast<T>(int(least_) + int(r));
    }

    void rank(const std::vector<T>& samples) {
        ranks_.resize(samples.size());
        uint32_t count = 0;
        if constexpr (std::is_floating_point_v<T>) {
            sorted_.clear();
            for (const T v : samples)
                if (!std::isnan(v))
                    sorted_.push_back(v);
            std::sort(sorted_.begin(), sorted_.end());
            sorted_.erase(std::unique(sorted_.begin(), sorted_.end()), sorted_.end());
            for (size_t i = 0; i < samples.size(); ++i)
                ranks_[i] =
                    std::isnan(samples[i])
                        ? kNone
                        : uint32_t(std::lower_bound(sorted_.begin(), sorted_.end(), samples[i]) -
                                   sorted_.begin());
            count = uint32_t(sorted_.size());
        } else {
            const auto [low, high] = std::minmax_element(samples.begin(), samples.end());
            least_ = *low;
            count = uint32_t(int(*high) - int(*low)) + 1;
            for (size_t i = 0; i < samples.size(); ++i)
                ranks_[i] = uint32_t(int(samples[i]) - int(least_));
        }
        fine_.assign(count / kCoarse * kCoarse + kCoarse, 0);
        coarse_.assign(fine_.size() / kCoarse, 0);
        count_ = below_ = middle_ = 0;
    }

    // Adds or takes away the samples of the box's plane x for the row (y, z).
    void put(int x, int y, int z, int sign) {
        const auto by = uint32_t(sign);
        for (int dz = 0; dz <= 2 * radius_.z; ++dz)
            for (int dy = 0; dy <= 2 * radius_.y; ++dy) {
                const uint32_t r = ranks_[place(x, y + dy, z + dz)];
                if (r == kNone)
                    continue;
                fine_[r] += by;
                coarse_[r / kCoarse] += by;
                count_ += by;
                below_ += r < middle_ ? by : 0;
            }
    }

    // The least rank that more than (count - 1) / 2 samples do not exceed; count > 0. below_ is how
    // many samples lie below middle_.
    uint32_t median() {
        const uint32_t target = (count_ - 1) / 2;
        while (below_ > target)
            if (middle_ % kCoarse == 0 && below_ - coarse_[middle_ / kCoarse - 1] > target) {
                middle_ -= kCoarse;
                below_ -= coarse_[middle_ / kCoarse];
            } else {
                below_ -= fine_[--middle_];
            }
        while (below_ + fine_[middle_] <= target)
            if (middle_ % kCoarse == 0 && below_ + coarse_[middle_ / kCoarse] <= target) {
                below_ += coarse_[middle_ / kCoarse];
                middle_ += kCoarse;
            } else {
                below_ += fine_[middle_++];
            }
        return middle_;
    }

    glm::ivec3 size_{}, radius_{};
    T least_{};
    std::vector<T> sorted_;
    std::vector<uint32_t> ranks_, fine_, coarse_;
    uint32_t count_ = 0, below_ = 0, middle_ = 0;
};

} // namespace palpate
