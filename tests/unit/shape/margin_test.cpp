#include "engine/segment/margin.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <limits>
#include <map>

#include "engine/segment/label_bounds.h"
#include "tests/unit/shape/random_labels.h"

namespace palpate {
namespace {

// Squared distances are whole multiples of unit^2: weight.x dx^2 + weight.y dy^2 + weight.z dz^2.
struct WallCase {
    Grid grid;
    double unit_mm;
    glm::ivec3 weight;
};

std::vector<WallCase> wall_cases() {
    Grid turned = make_grid({9, 8, 37}, {0.7, 1.4, 0.7}, {-5, 3, 11});
    const glm::dmat3 turn = glm::dmat3(0.8, 0.6, 0, -0.6, 0.8, 0, 0, 0, 1);
    for (int axis = 0; axis < 3; ++axis)
        turned.world_from_index[axis] =
            glm::dvec4(turn * glm::dvec3(turned.world_from_index[axis]), 0.0);
    return {{make_grid({35, 10, 6}, {0.5, 1.0, 2.0}), 0.5, {1, 4, 16}}, {turned, 0.7, {1, 4, 1}}};
}

constexpr long kNoDistance = std::numeric_limits<long>::max();

// By definition, the squared distance from each sample to the nearest of the other kind.
std::vector<long> squared_distances(const WallCase& c, const std::vector<float>& labels,
                                    float label) {
    std::vector<long> out(labels.size(), kNoDistance);
    for (size_t i = 0; i < labels.size(); ++i)
        for (size_t j = 0; j < labels.size(); ++j)
            if ((labels[i] == label) != (labels[j] == label)) {
                const glm::ivec3 d =
                    glm::ivec3(index_of(c.grid.size, i)) - glm::ivec3(index_of(c.grid.size, j));
                const glm::ivec3 squared = d * d * c.weight;
                out[i] = std::min<long>(out[i], squared.x + squared.y + squared.z);
            }
    return out;
}

// One list a label of the map.
using Distances = std::map<float, std::vector<long>>;

// The map that results where samples of the labels `of` stay that `stays` says, by their distance
// to the border, and those join that `joins` says.
template <class Stays, class Joins, class MayTake>
std::vector<float> wall_twin(double unit_mm, const Distances& distances,
                             const std::vector<float>& labels, const std::vector<float>& of,
                             const Stays& stays, const Joins& joins, const MayTake& may_take) {
    std::vector<float> out = labels;
    std::vector<long> nearest(labels.size(), kNoDistance);
    for (const float label : of) { // ascending: of equally near ones the lowest
        const std::vector<long>& squared = distances.at(label);
        for (size_t i = 0; i < labels.size(); ++i) {
            const double mm =
                squared[i] == kNoDistance ? INFINITY : unit_mm * std::sqrt(double(squared[i]));
            if (labels[i] == label) {
                if (!stays(mm))
                    out[i] = 0.0f;
            } else if (may_take(labels[i]) && joins(mm) && squared[i] < nearest[i]) {
                nearest[i] = squared[i];
                out[i] = label;
            }
        }
    }
    return out;
}

// Blobs of labels 1 .. 3, so that there is something within and between, of type T.
template <class T>
Volume blobs(const Grid& grid, uint64_t seed, T step) {
    std::mt19937_64 random(seed);
    const auto any = [&](double below) { return double(random() % 1000) / 1000.0 * below; };
    std::vector<T> samples(sample_count(grid), T(0));
    for (int n = 0; n < 9; ++n) {
        const glm::dvec3 middle(any(grid.size.x), any(grid.size.y), any(grid.size.z));
        const double radius = 1.0 + any(4.0);
        for (size_t i = 0; i < samples.size(); ++i) {
            const glm::dvec3 d = glm::dvec3(index_of(grid.size, i)) - middle;
            if (glm::length(d * spacing_mm(grid)) < radius)
                samples[i] = T(T(n % 3 + 1) * step);
        }
    }
    return make_volume<T>(grid, samples);
}

class EveryWallMap : public testing::TestWithParam<int> {
 protected:
    WallCase one() const { return wall_cases()[size_t(GetParam()) / 2]; }
    float step() const { return GetParam() % 2 ? 300.0f : 1.0f; }
    Volume map() const {
        const uint64_t seed = 7 + uint64_t(GetParam());
        return GetParam() % 2 ? blobs<uint16_t>(one().grid, seed, 300)
                              : blobs<uint8_t>(one().grid, seed, 1);
    }
    // The three labels, but for a locked one.
    std::vector<float> labels(float without = 0.0f) const {
        std::vector<float> all;
        for (const float label : {step(), 2 * step(), 3 * step()})
            if (label != without)
                all.push_back(label);
        return all;
    }
    Distances distances(const std::vector<float>& samples) const {
        Distances all;
        for (const float label : labels())
            all[label] = squared_distances(one(), samples, label);
        return all;
    }
    static bool is_free(float label) { return label == 0.0f; }
};

TEST_P(EveryWallMap, AMarginIsThatOfItsDefinition) {
    const Volume map = this->map();
    const std::vector<float> before = samples_of(map);
    const Distances squared = distances(before);
    const double unit = one().unit_mm;
    for (const double mm : {0.5, 1.0, 2.1, 4.2}) {
        const auto grown = [&](double d) { return d <= mm * (1.0 + 1e-9); };
        const auto all = [](double) { return true; };
        const auto none = [](double) { return false; };
        EXPECT_EQ(samples_of(*margin(map, mm, {}, {})),
                  wall_twin(unit, squared, before, labels(), all, grown, is_free))
            << mm;
        EXPECT_EQ(samples_of(*margin(map, -mm, {}, {})),
                  wall_twin(
                      unit, squared, before, labels(),
                      [&](double d) { return d > mm * (1.0 + 1e-9); }, none, is_free))
            << -mm;
        const std::array locked{uint16_t(3 * step())};
        EXPECT_EQ(samples_of(*margin(map, mm, {.locked = locked}, {})),
                  wall_twin(unit, squared, before, labels(3 * step()), all, grown, is_free));
        EXPECT_EQ(
            samples_of(*margin(
                map, mm, {.label = uint16_t(2 * step()), .overwrite = true, .locked = locked}, {})),
            wall_twin(unit, squared, before, {2 * step()}, all, grown,
                      [&](float label) { return label != 3 * step(); }));
    }
}

TEST_P(EveryWallMap, AWallIsThatOfItsDefinition) {
    const Volume map = this->map();
    const std::vector<float> before = samples_of(map);
    const Distances squared = distances(before);
    const double unit = one().unit_mm;
    for (const double mm : {1.4, 2.0, 3.0})
        for (const std::vector<float>& of : {labels(), {step()}}) {
            const ChangedLabels which{of.size() == 1 ? std::optional(uint16_t(step()))
                                                     : std::nullopt};
            const auto within = [](double least) {
                return [least](double d) { return d <= least * (1.0 + 1e-9); };
            };
            const auto none = [](double) { return false; };
            const auto hollowed = [&](Wall wall) {
                return samples_of(*hollow(map, mm, wall, which, {}));
            };
            EXPECT_EQ(hollowed(Wall::inside),
                      wall_twin(unit, squared, before, of, within(mm), none, is_free));
            EXPECT_EQ(hollowed(Wall::middle), wall_twin(unit, squared, before, of, within(0.5 * mm),
                                                        within(0.5 * mm), is_free));
            EXPECT_EQ(hollowed(Wall::outside),
                      wall_twin(unit, squared, before, of, none, within(mm), is_free));
        }
}

TEST_P(EveryWallMap, TheNumberOfThreadsChangesNoBit) {
    const Volume map = this->map();
    const std::vector<float> grown = samples_of(*margin(map, 2.0, {}, {})),
                             wall = samples_of(*hollow(map, 2.0, Wall::middle, {}, {}));
    for (const size_t threads : {1, 2, 4}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        EXPECT_EQ(samples_of(*margin(map, 2.0, {}, {})), grown);
        EXPECT_EQ(samples_of(*hollow(map, 2.0, Wall::middle, {}, {})), wall);
    }
}

TEST_P(EveryWallMap, BoundsAreTheLeastAndTheGreatestIndex) {
    const Volume map = this->map();
    const std::vector<float> samples = samples_of(map);
    std::map<uint16_t, IndexBox> expected;
    for (size_t i = 0; i < samples.size(); ++i)
        if (samples[i] != 0.0f) {
            const glm::ivec3 at(index_of(map.size(), i));
            IndexBox& box =
                expected.try_emplace(uint16_t(samples[i]), IndexBox{at, at}).first->second;
            box = {glm::min(box.low, at), glm::max(box.high, at)};
        }
    EXPECT_EQ(label_bounds(map, {}), expected);
}

INSTANTIATE_TEST_SUITE_P(GridsAndTypes, EveryWallMap, testing::Range(0, 4));

TEST(Margin, BricksThatDoNotChangeStayShared) {
    const Volume map = make_volume(make_grid({100, 40, 40}, {1, 1, 1}), ScalarType::u8,
                                   [](glm::uvec3 i) { return i.x < 10 && i.y < 10 ? 1.0 : 0.0; });
    const Result<Volume> grown = margin(map, 2.0, {}, {});
    EXPECT_EQ(grown->brick_ptr({2, 0, 0}), map.brick_ptr({2, 0, 0}));
    EXPECT_NE(grown->brick_ptr({0, 0, 0}), map.brick_ptr({0, 0, 0}));
}

TEST(Margin, WhatCannotBeIsRefused) {
    const Volume map = make_volume(make_grid({4, 4, 4}, {1, 1, 1}), ScalarType::u8,
                                   [](glm::uvec3 i) { return i.x; });
    const std::array locked{uint16_t{2}};
    EXPECT_FALSE(margin(map, 0.0, {}, {}));
    EXPECT_FALSE(margin(map, 1.0, {.label = uint16_t{0}}, {}));
    EXPECT_FALSE(margin(map, 1.0, {.label = uint16_t{2}, .locked = locked}, {}));
    EXPECT_FALSE(hollow(map, 0.0, Wall::inside, {}, {}));
    EXPECT_FALSE(hollow(map, 0.9, Wall::outside, {}, {})); // samples are 1 mm apart
    EXPECT_FALSE(hollow(map, 1.9, Wall::middle, {}, {}));
    EXPECT_TRUE(hollow(map, 2.0, Wall::middle, {}, {}));
    std::stop_source stop;
    stop.request_stop();
    EXPECT_FALSE(margin(map, 1.0, {}, {stop.get_token(), {}}));
}

} // namespace
} // namespace palpate
