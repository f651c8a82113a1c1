#include "engine/segment/interpolate_slices.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <array>
#include <cmath>
#include <map>
#include <random>

#include "tests/unit/shape/random_labels.h"
#include "tests/unit/shape/slice_twin.h"

namespace palpate {
namespace {

// Every fifth slice of a cone of circles; between them circles are the blend of their neighbours'.
TEST(InterpolateSlices, OfCirclesGivesTheCirclesBetween) {
    for (const int axis : {0, 1, 2}) {
        glm::uvec3 size(41);
        glm::dvec3 spacing(0.8);
        size[axis] = 26;
        spacing[axis] = 3.0;
        const Grid grid = make_grid(size, spacing);
        const auto radius = [](double k) { return 4.0 + 0.35 * k; }; // mm
        const auto off_mm = [&](glm::uvec3 i) {
            glm::dvec3 p = glm::dvec3(i) - 20.0;
            p[axis] = 0.0;
            return glm::length(p * spacing);
        };
        const Volume drawn = make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) {
            return i[axis] % 5 == 0 && off_mm(i) < radius(i[axis]) ? 3.0 : 0.0;
        });
        const Result<Volume> made = interpolate_slices(drawn, {.axis = axis}, {});
        ASSERT_TRUE(made) << made.error().message;
        for (size_t n = 0; n < sample_count(grid); ++n) {
            const glm::uvec3 i = index_of(size, n);
            // Distances in a slice err by a diagonal of its samples at most, and so do blends.
            const double off = off_mm(i) - radius(i[axis]);
            if (std::abs(off) > 0.8 * std::sqrt(2.0)) {
                EXPECT_EQ(made->value(i), off < 0.0 ? 3.0f : 0.0f);
            }
            if (i[axis] % 5 == 0) {
                EXPECT_EQ(made->value(i), drawn.value(i));
            }
        }
    }
}

TEST(InterpolateSlices, KeepsWhatIsDrawnAndFillsNothingOutsideTheDrawnSlices) {
    const Volume drawn =
        make_volume(make_grid({20, 20, 12}, {1, 1, 2}), ScalarType::u16, [](glm::uvec3 i) {
            if (i.z == 2 || i.z == 8)
                return i.x < 12 ? 700.0 : 0.0;
            return i.z == 5 && i.y < 10 ? 9.0 : 0.0;
        });
    const Result<Volume> made = interpolate_slices(drawn, {.axis = 2}, {});
    ASSERT_TRUE(made);
    EXPECT_EQ(made->type(), ScalarType::u16);
    for (size_t n = 0; n < sample_count(drawn.grid()); ++n) {
        const glm::uvec3 i = index_of(drawn.size(), n);
        const bool between = i.z > 2 && i.z < 8 && i.x < 12;
        EXPECT_EQ(made->value(i), drawn.value(i) != 0.0f ? drawn.value(i)
                                  : between              ? 700.0f
                                                         : 0.0f);
    }
}

TEST(InterpolateSlices, GivesASampleToTheDeeperOfTwoLabels) {
    const Volume drawn =
        make_volume(make_grid({30, 30, 5}, {1, 1, 1}), ScalarType::u8, [](glm::uvec3 i) {
            const double edge = i.z == 0 ? 10 : 20;
            return i.z % 4 ? 0.0 : i.x < edge ? 1.0 : 2.0;
        });
    const Result<Volume> made = interpolate_slices(drawn, {.axis = 2}, {});
    for (uint32_t x = 0; x < 30; ++x) // the wall moves evenly from 10 to 20
        EXPECT_EQ(made->value({x, 15, 2}), x < 15 ? 1.0f : 2.0f) << x;
    EXPECT_FALSE(interpolate_slices(drawn, {.axis = 3}, {}));
    const Volume empty = make_volume(make_grid({3, 3, 3}, {1, 1, 1}), ScalarType::u8,
                                     [](glm::uvec3) { return 0.0; });
    EXPECT_EQ(samples_of(*interpolate_slices(empty, {.axis = 0}, {})), samples_of(empty));
}

// Slices drawn at uneven places, across each axis, of three labels with pieces that come, go, split
// and join.
TEST(InterpolateSlices, IsThatOfItsDefinition) {
    using slice_twin::Slice;
    std::mt19937_64 random(4);
    const auto below = [&](double most) { return most * double(random() % 1000) / 1000.0; };
    size_t compared = 0, made_here = 0;
    for (const glm::dvec3 spacing : {glm::dvec3(1.0), glm::dvec3(0.6, 1.1, 2.5)})
        for (const float step : {1.0f, 300.0f}) // u8 and u16
            for (int axis = 0; axis < 3; ++axis) {
                const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
                glm::uvec3 size(19, 19, 19);
                size[axis] = 12;
                size[u] = 23;
                const Grid grid = make_grid(size, spacing);
                std::vector<glm::dvec4> discs; // slice, middle, radius
                for (const int slice : {1, 5, 6, 10})
                    for (int n = 0; n < 5; ++n)
                        discs.emplace_back(slice, below(22.0), below(18.0), 1.5 + below(3.0));
                const Volume drawn = make_volume(
                    grid, step > 1.0f ? ScalarType::u16 : ScalarType::u8, [&](glm::uvec3 i) {
                        for (size_t n = 0; n < discs.size(); ++n)
                            if (double(i[axis]) == discs[n].x &&
                                std::hypot(i[u] - discs[n].y, i[v] - discs[n].z) < discs[n].w)
                                return double(step) * double(n % 3 + 1);
                        return 0.0;
                    });
                const Result<Volume> made = interpolate_slices(drawn, {.axis = axis}, {});
                ASSERT_TRUE(made) << made.error().message;
                EXPECT_EQ(made->type(), drawn.type());
                const auto slice_of = [&](float label, int k) {
                    Slice out{{int(size[u]), int(size[v])}, {}};
                    out.has.resize(size_t{size[u]} * size[v]);
                    out.each([&](glm::ivec2 p) {
                        glm::uvec3 at(k);
                        at[u] = uint32_t(p.x);
                        at[v] = uint32_t(p.y);
                        out.has[out.place(p)] = drawn.value(at) == label;
                    });
                    return out;
                };
                std::map<int, std::map<float, std::vector<double>>> between; // by slice and label
                for (const float label : {step, 2 * step, 3 * step}) {
                    int last = -1;
                    for (int k = 0; k < int(size[axis]); ++k) {
                        const Slice here = slice_of(label, k);
                        if (here.count() == 0)
                            continue;
                        for (int n = last + 1; last >= 0 && n < k; ++n)
                            between[n][label] = slice_twin::blends(
                                slice_of(label, last), here, {spacing[u], spacing[v]},
                                double(n - last) / double(k - last));
                        last = k;
                    }
                }
                for (size_t n = 0; n < sample_count(grid); ++n) {
                    const glm::uvec3 i = index_of(size, n);
                    const size_t in_slice = i[u] + size_t{size[u]} * i[v];
                    float expected = drawn.value(i);
                    double lowest = 0.0, apart = 1.0; // from the next lower or higher blend
                    for (const auto& [label, blend] : between[int(i[axis])]) {
                        if (drawn.value(i) != 0.0f)
                            break;
                        apart = std::min(apart, std::abs(blend[in_slice] - lowest));
                        if (blend[in_slice] < lowest) {
                            lowest = blend[in_slice];
                            expected = label;
                        }
                    }
                    if (apart < 1e-5) // floats decide
                        continue;
                    ++compared;
                    made_here += drawn.value(i) == 0.0f && expected != 0.0f;
                    ASSERT_EQ(made->value(i), expected)
                        << "axis " << axis << " at " << i.x << ", " << i.y << ", " << i.z;
                }
            }
    EXPECT_GT(compared, 50000u);
    EXPECT_GT(made_here, 3000u);
}

// Discs that do not lie over each other, as of a vessel that runs aslant: between them is the disc,
// moved.
TEST(InterpolateSlices, TubesThatRunAslantStayRound) {
    const Grid grid = make_grid({60, 30, 25}, {1, 1, 2});
    const auto off_mm = [](glm::uvec3 i) {
        return glm::length(glm::dvec2(i) - glm::dvec2(10.0 + 1.5 * i.z, 15.0)) - 4.2;
    };
    const Volume drawn = make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) {
        return i.z % 8 == 0 && off_mm(i) < 0.0 ? 1.0 : 0.0;
    });
    const Result<Volume> made = interpolate_slices(drawn, {}, {});
    for (size_t n = 0; n < sample_count(grid); ++n) {
        const glm::uvec3 i = index_of(grid.size, n);
        // Distances in a slice err by a diagonal of its samples at most.
        if (const double off = off_mm(i); std::abs(off) > std::sqrt(2.0)) {
            EXPECT_EQ(made->value(i), off < 0.0 ? 1.0f : 0.0f) << i.x << ", " << i.y << ", " << i.z;
        }
    }
}

// A disc becomes two: every slice between has what both have in common, and the two halves
// are apart near their end.
TEST(InterpolateSlices, APieceBecomesTwo) {
    const Volume drawn =
        make_volume(make_grid({40, 24, 9}, {1, 1, 1}), ScalarType::u8, [](glm::uvec3 i) {
            const bool one = i.z == 0 && std::hypot(i.x - 19.5, i.y - 11.5) < 9.0;
            const bool left = i.z == 8 && std::hypot(i.x - 12.0, i.y - 11.5) < 4.0;
            const bool right = i.z == 8 && std::hypot(i.x - 27.0, i.y - 11.5) < 4.0;
            return one || left || right ? 1.0 : 0.0;
        });
    const Result<Volume> made = interpolate_slices(drawn, {}, {});
    for (uint32_t z = 0; z < 9; ++z)
        for (uint32_t x = 0; x < 40; ++x) {
            if (drawn.value({x, 11, 0}) != 0.0f && drawn.value({x, 11, 8}) != 0.0f) {
                EXPECT_EQ(made->value({x, 11, z}), 1.0f) << x << ", " << z;
            }
            EXPECT_EQ(made->value({x, 11, z}), made->value({39 - x, 11, z})) << x << ", " << z;
        }
    EXPECT_EQ(made->value({19, 11, 1}), 1.0f);
    EXPECT_EQ(made->value({19, 11, 7}), 0.0f);
}

TEST(InterpolateSlices, EachLabelHasItsOwnAxisAndLockedOnesGetNothing) {
    const Volume drawn =
        make_volume(make_grid({30, 30, 30}, {1, 1, 2}), ScalarType::u8, [](glm::uvec3 i) {
            if (i.x < 8 && i.y < 8)
                return i.z % 5 == 0 ? 1.0 : 0.0;
            return i.x > 12 && i.y % 4 == 0 && i.z > 12 && i.z < 20 ? 2.0 : 0.0;
        });
    EXPECT_EQ(axis_with_gaps(drawn, 1), 2);
    EXPECT_EQ(axis_with_gaps(drawn, 2), 1);
    EXPECT_EQ(axis_with_gaps(drawn, 3), -1);
    const Result<Volume> made = interpolate_slices(drawn, {}, {});
    EXPECT_EQ(made->value({4, 4, 13}), 1.0f);
    EXPECT_EQ(made->value({20, 14, 15}), 2.0f);
    EXPECT_EQ(made->value({20, 29, 15}), 0.0f); // beyond the last
    const std::array locked{uint16_t{2}};
    const Result<Volume> without = interpolate_slices(drawn, {.locked = locked}, {});
    EXPECT_EQ(without->value({4, 4, 13}), 1.0f);
    EXPECT_EQ(without->value({20, 14, 15}), 0.0f);
    const Result<Volume> one = interpolate_slices(drawn, {.label = uint16_t{2}}, {});
    EXPECT_EQ(one->value({4, 4, 13}), 0.0f);
    EXPECT_EQ(one->value({20, 14, 15}), 2.0f);
    for (const size_t threads : {1, 2, 4}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        EXPECT_EQ(samples_of(*interpolate_slices(drawn, {}, {})), samples_of(*made));
    }
}

} // namespace
} // namespace palpate
