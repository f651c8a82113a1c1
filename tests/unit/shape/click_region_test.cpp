#include "engine/segment/click_region.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <set>

#include "tests/unit/shape/random_labels.h"

namespace palpate {
namespace {

std::array<Grid, 2> click_grids() {
    const glm::uvec3 size(34, 13, 9);
    glm::dmat4 turned = glm::rotate(glm::dmat4(1.0), 1.1, glm::dvec3(0.4, 0.3, -0.8));
    turned = glm::scale(turned, glm::dvec3(0.7, -1.1, 2.3));
    return {make_grid(size, glm::dvec3(1.0)), Grid{size, turned}};
}

// Waves and noise, so that regions are neither single samples nor all.
Volume wavy(const Grid& grid, ScalarType type, uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    const glm::dvec3 wave(0.2 + 0.3 * share(random), 0.2 + 0.4 * share(random),
                          0.3 + 0.5 * share(random));
    return make_volume(grid, type, [&](glm::uvec3 i) {
        const glm::dvec3 at = wave * glm::dvec3(i);
        if (type == ScalarType::f32 && share(random) < 0.02)
            return std::nan("");
        return std::round(100.0 + 60.0 * std::sin(at.x + at.z) * std::cos(at.y) +
                          12.0 * share(random));
    });
}

double middle_of(std::vector<double> values) { // by sorting
    std::sort(values.begin(), values.end());
    return values[(values.size() - 1) / 2];
}

// Samples join, pass by pass over the volume, until none does.
std::vector<float> local_twin(const Volume& volume, const LocalThreshold& click) {
    const Grid& grid = volume.grid();
    const size_t count = sample_count(grid);
    std::vector<double> values, away_mm, near;
    for (size_t n = 0; n < count; ++n) {
        const glm::uvec3 i = index_of(grid.size, n);
        values.push_back(double{volume.value(i)});
        away_mm.push_back(glm::distance(world_point(grid, glm::dvec3(i)),
                                        world_point(grid, glm::dvec3(click.at))));
        const glm::ivec3 by = glm::abs(glm::ivec3(i) - glm::ivec3(click.at));
        if (!std::isnan(values[n]) &&
            (away_mm[n] <= click.near_mm + 1e-9 || std::max({by.x, by.y, by.z}) <= 1))
            near.push_back(values[n]);
    }
    const double own = double{volume.value(click.at)};
    std::sort(near.begin(), near.end()); // and then by distance; equal distances: the lower first
    std::stable_sort(near.begin(), near.end(),
                     [&](double a, double b) { return std::abs(a - own) < std::abs(b - own); });
    near.resize(size_t(std::ceil(0.25 * double(near.size()))));
    const double farthest = std::abs(near.back() - own), middle = middle_of(near);
    const ValueRange range = volume.range();
    const double spread =
        std::max(farthest / 0.3186, 1e-3 * (double{range.max} - double{range.min}));
    std::vector<float> taken(count);
    taken[click.at.x + size_t{grid.size.x} * (click.at.y + size_t{grid.size.y} * click.at.z)] = 1;
    for (bool has_grown = true; has_grown;) {
        has_grown = false;
        for (size_t n = 0; n < count; ++n) {
            const bool is_alike =
                (values[n] >= middle - click.times * spread || values[n] >= own) &&
                (values[n] <= middle + click.times * spread || values[n] <= own);
            if (taken[n] != 0.0f || !is_alike || away_mm[n] > click.reach_mm + 1e-9)
                continue;
            const glm::ivec3 i(index_of(grid.size, n)), size(grid.size);
            const std::array steps{1, size.x, size.x * size.y};
            for (int axis = 0; axis < 3; ++axis)
                for (const int by : {-1, 1})
                    if (i[axis] + by >= 0 && i[axis] + by < size[axis] &&
                        taken[n + size_t(by * steps[size_t(axis)])] != 0.0f) {
                        taken[n] = 1.0f;
                        has_grown = true;
                    }
        }
    }
    return taken;
}

TEST(LocalThreshold, TakesWhatItsDefinitionSays) {
    std::mt19937 random(2);
    size_t large = 0, part = 0;
    for (const Grid& grid : click_grids())
        for (const ScalarType type : {ScalarType::i16, ScalarType::f32})
            for (int round = 0; round < 4; ++round) {
                const Volume volume = wavy(grid, type, random());
                LocalThreshold click{
                    .at = {random() % grid.size.x, random() % grid.size.y, random() % grid.size.z},
                    .reach_mm = 2.0 + double(random() % 90) / 7.0,
                    .near_mm = double(random() % 30) / 11.0,
                    .times = 1.0 + double(random() % 30) / 9.0};
                if (std::isnan(volume.value(click.at)))
                    continue;
                const Result<ClickRegion> region = local_region(volume, click, {});
                ASSERT_TRUE(region) << region.error().message;
                const std::vector<float> expected = local_twin(volume, click);
                ASSERT_EQ(samples_of(*volume_of(*region, grid, 1, {})), expected)
                    << "round " << round;
                const auto count =
                    static_cast<uint64_t>(std::count(expected.begin(), expected.end(), 1.0f));
                EXPECT_EQ(region->count, count);
                large += count > 20;
                part += count > 1 && count < expected.size() / 2;
            }
    EXPECT_GT(large, 4u);
    EXPECT_GT(part, 4u) << "the cases are neither a sample nor all";
}

// A ball of another value is taken whole; its values are those of the ball.
TEST(LocalThreshold, TakesABall) {
    const Grid grid = make_grid({40, 40, 20}, {1.0, 1.0, 2.0});
    const glm::dvec3 middle = center_mm(grid);
    const auto is_in = [&](glm::uvec3 i) {
        return glm::distance(world_point(grid, glm::dvec3(i)), middle) < 12.0;
    };
    std::mt19937 random(7);
    const Volume volume = make_volume(grid, ScalarType::i16, [&](glm::uvec3 i) {
        return (is_in(i) ? 100.0 : 0.0) + double(random() % 11);
    });
    // Uniform on 0 .. 10: a quarter lies within 2.75 of any value or less, on average, and 3 s hold
    // all; the ball's lowest value is 90 above what lies about it.
    const Result<ClickRegion> region = local_region(volume, {.at = {20, 20, 10}}, {});
    ASSERT_TRUE(region);
    for (size_t n = 0; n < sample_count(grid); ++n)
        ASSERT_EQ(region->has(index_of(grid.size, n)), is_in(index_of(grid.size, n))) << n;
    EXPECT_GT(region->least, 10.0);
    const Result<ClickRegion> small =
        local_region(volume, {.at = {20, 20, 10}, .reach_mm = 5.0}, {});
    for (size_t n = 0; n < sample_count(grid); ++n) {
        const glm::dvec3 at = world_point(grid, glm::dvec3(index_of(grid.size, n)));
        ASSERT_EQ(small->has(index_of(grid.size, n)),
                  glm::distance(at, world_point(grid, {20, 20, 10})) <= 5.0);
    }
}

// Walks along the contour: from edge to edge between a sample at or above the level and one below
// it, through the squares of four samples, until it is back. Higher samples are not joined over
// corners. What it surrounds is what a line from a sample to the right crosses it an odd number of
// times.
class ContourWalk {
 public:
    ContourWalk(const Volume& volume, const LevelTrace& click) : volume_(volume), click_(click) {
        across_ = click.axis == 0 ? 1 : 0;
        down_ = click.axis == 2 ? 1 : 2;
        layer_ = static_cast<uint32_t>(std::lround(click.at[click.axis]));
        const glm::dvec2 at(click.at[across_], click.at[down_]);
        const glm::ivec2 first(glm::floor(at));
        const glm::dvec2 share = at - glm::dvec2(first);
        level_ = glm::mix(
            glm::mix(value(first), value(first + glm::ivec2(1, 0)), share.x),
            glm::mix(value(first + glm::ivec2(0, 1)), value(first + glm::ivec2(1, 1)), share.x),
            share.y);
        double nearest = 9.0;
        for (int corner = 0; corner < 4; ++corner) {
            const glm::ivec2 by(corner & 1, corner >> 1);
            const double far = glm::distance(share, glm::dvec2(by));
            if (value(first + by) >= level_ && far < nearest) {
                nearest = far;
                start_ = first + by;
            }
        }
        // An edge of the square that has the nearest higher corner at one end.
        const glm::ivec2 opposite = 2 * first + 1 - start_;
        for (const glm::ivec2 other : {glm::ivec2(opposite.x, start_.y), {start_.x, opposite.y}})
            if (value(other) < level_ && out_ == glm::ivec2(0))
                out_ = other - start_;
        // Else the lower corner is across the square: no edge of it, and the walk begins beside it.
        if (out_ == glm::ivec2(0)) {
            start_ = {opposite.x, start_.y};
            out_ = opposite - start_;
        }
    }

    std::set<std::array<int, 2>> inside() const {
        std::vector<std::array<glm::ivec2, 2>> edges; // a higher sample, and the lower one beside
        glm::ivec2 at = start_, out = out_;
        do {
            edges.push_back({at, out});
            const glm::ivec2 along(-out.y, out.x); // to the left of the way out
            if (value(at + along) < level_)
                out = along; // a corner of the higher side
            else if (value(at + along + out) < level_)
                at += along; // straight on
            else
                at += along + out, out = -along; // into a notch
        } while (at != start_ || out != out_);
        std::set<std::array<int, 2>> inside;
        const glm::ivec2 size(volume_.size()[across_], volume_.size()[down_]);
        for (int y = 0; y < size.y; ++y)
            for (int x = 0; x < size.x; ++x) {
                int crossed = 0; // upright edges of samples to the right of it
                for (const auto& [sample, way] : edges)
                    crossed += way.y == 0 && sample.y == y &&
                               double(sample.x) + 0.5 * double(way.x) > double(x);
                if (crossed % 2 == 1)
                    inside.insert({x, y});
            }
        return inside;
    }
    bool has_both_sides() const { return out_ != glm::ivec2(0) && value(start_ + out_) < level_; }
    uint32_t layer() const { return layer_; }

 private:
    double value(glm::ivec2 at) const {
        glm::ivec3 i(0);
        i[across_] = at.x;
        i[down_] = at.y;
        i[click_.axis] = int(layer_);
        if (glm::any(glm::lessThan(i, glm::ivec3(0))) ||
            glm::any(glm::greaterThanEqual(i, glm::ivec3(volume_.size()))))
            return -1e30;
        const double value = double{volume_.value(glm::uvec3(i))};
        return std::isnan(value) ? -1e30 : value;
    }

    const Volume& volume_;
    const LevelTrace& click_;
    int across_, down_;
    uint32_t layer_;
    double level_ = 0.0;
    glm::ivec2 start_{0}, out_{0};
};

TEST(LevelTrace, TakesWhatAWalkAlongTheContourSurrounds) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> share(0.01, 0.99);
    size_t cases = 0, holes = 0;
    for (const Grid& grid : click_grids())
        for (const ScalarType type : {ScalarType::u8, ScalarType::f32})
            for (int round = 0; round < 60; ++round) {
                const Volume volume = wavy(grid, type, random());
                LevelTrace click{.axis = round % 3};
                for (int a = 0; a < 3; ++a)
                    click.at[a] = share(random) * (double(grid.size[a]) - 1.0);
                const Result<ClickRegion> region = level_region(volume, click, {});
                if (!region) // without data, or all alike
                    continue;
                const ContourWalk walk(volume, click);
                ASSERT_TRUE(walk.has_both_sides());
                const auto expected = walk.inside();
                const int across = click.axis == 0 ? 1 : 0, down = click.axis == 2 ? 1 : 2;
                std::set<std::array<int, 2>> got;
                for (size_t n = 0; n < sample_count(grid); ++n) {
                    const glm::uvec3 i = index_of(grid.size, n);
                    if (!region->has(i))
                        continue;
                    ASSERT_EQ(i[click.axis], walk.layer());
                    got.insert({int(i[across]), int(i[down])});
                }
                ASSERT_EQ(got, expected) << "round " << round;
                EXPECT_EQ(region->count, got.size());
                ++cases;
                for (const auto& at : got) {
                    glm::uvec3 i(0);
                    i[across] = uint32_t(at[0]), i[down] = uint32_t(at[1]);
                    i[click.axis] = walk.layer();
                    if (volume.value(i) < region->least) {
                        ++holes;
                        break;
                    }
                }
            }
    EXPECT_GT(cases, 200u);
    EXPECT_GT(holes, 20u) << "some have samples below the level within";
}

// Discs, bright and dark, are taken from a place on their edge, and so is a ring with its hole.
TEST(LevelTrace, TakesBrightAndDarkDiscs) {
    const Grid grid = make_grid({60, 60, 3}, glm::dvec3(1.0));
    const auto radius = [](glm::uvec3 i) {
        return glm::distance(glm::dvec2(i), glm::dvec2(30.0, 30.0));
    };
    for (const double sign : {1.0, -1.0}) {
        const Volume volume = make_volume(grid, ScalarType::i16, [&](glm::uvec3 i) {
            return sign * (radius(i) < 10.3 ? 0.0 : radius(i) < 20.3 ? 100.0 : 20.0);
        });
        for (const auto& [edge, most] : {std::pair(10.3, 10.3), {20.3, 20.3}}) {
            const Result<ClickRegion> region =
                level_region(volume, {.at = {30.0 + edge + 0.15, 30.0, 1.2}}, {});
            ASSERT_TRUE(region) << region.error().message;
            for (size_t n = 0; n < sample_count(grid); ++n) {
                const glm::uvec3 i = index_of(grid.size, n);
                ASSERT_EQ(region->has(i), i.z == 1 && radius(i) < most) << sign << " " << edge;
            }
        }
    }
}

TEST(ClickRegion, IsTheSameForAnyNumberOfThreads) {
    const Grid grid{{70, 66, 40}, click_grids()[1].world_from_index};
    const Volume volume = wavy(grid, ScalarType::i16, 4);
    std::optional<std::vector<float>> first;
    for (const size_t threads : {1, 2, 4}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        const Result<ClickRegion> region = local_region(volume, {.at = {35, 33, 20}}, {});
        const std::vector<float> got = samples_of(*volume_of(*region, grid, 300, {}));
        EXPECT_EQ(got, first.value_or(got)) << threads;
        EXPECT_EQ(volume_of(*region, grid, 300, {})->range().max, 300.0f);
        first = got;
    }
}

TEST(ClickRegion, RefusesPlacesWithoutAnAnswer) {
    const Grid grid = make_grid({8, 8, 1}, glm::dvec3(1.0));
    const Volume flat = make_volume(grid, ScalarType::f32,
                                    [](glm::uvec3 i) { return i.x == 0 ? std::nan("") : 5.0; });
    EXPECT_FALSE(local_region(flat, {.at = {8, 0, 0}}, {}));
    EXPECT_FALSE(local_region(flat, {.at = {0, 3, 0}}, {}));
    EXPECT_EQ(local_region(flat, {.at = {3, 3, 0}}, {})->count, 56u) << "constant: all with data";
    EXPECT_FALSE(level_region(flat, {.at = {4.5, 4.5, 0.0}}, {})) << "no contour";
    EXPECT_FALSE(level_region(flat, {.at = {0.5, 4.5, 0.0}}, {})) << "no data";
    EXPECT_FALSE(level_region(flat, {.at = {4.5, 9.5, 0.0}}, {})) << "beyond";
    EXPECT_FALSE(level_region(flat, {.at = {4.5, 4.5, 0.0}, .axis = 1}, {})) << "one row";
}

} // namespace
} // namespace palpate
