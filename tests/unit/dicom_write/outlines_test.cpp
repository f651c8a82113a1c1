// Outlines of samples, and the areas that polygons cover, against sums and clipped polygons.

#include "engine/io/outlines.h"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

namespace palpate {
namespace {

using io::covered_areas;
using io::Outline;
using io::outlines_of;

double area_of(const Outline& outline) {
    double twice = 0;
    for (size_t i = 0; i < outline.size(); ++i) {
        const glm::dvec2 a = outline[i], b = outline[(i + 1) % outline.size()];
        twice += a.x * b.y - b.x * a.y;
    }
    return 0.5 * twice;
}

// How many groups of samples with the label are neighbours across edges.
size_t pieces(std::vector<uint16_t> slice, glm::uvec2 size, uint16_t label) {
    size_t count = 0;
    for (size_t start = 0; start < slice.size(); ++start) {
        if (slice[start] != label)
            continue;
        ++count;
        std::vector<size_t> todo{start};
        slice[start] = 0;
        while (!todo.empty()) {
            const size_t at = todo.back(), x = at % size.x, y = at / size.x;
            todo.pop_back();
            const auto visit = [&](bool is_in, size_t next) {
                if (is_in && slice[next] == label) {
                    slice[next] = 0;
                    todo.push_back(next);
                }
            };
            visit(x > 0, at - 1);
            visit(x + 1 < size.x, at + 1);
            visit(y > 0, at - size.x);
            visit(y + 1 < size.y, at + size.x);
        }
    }
    return count;
}

TEST(Outlines, EncloseExactlyTheSamplesTheyAreMadeOf) {
    std::mt19937 random(2);
    for (int round = 0; round < 400; ++round) {
        std::uniform_int_distribution<uint32_t> side(1, 14);
        const glm::uvec2 size(side(random), side(random));
        // From scattered samples to full areas with holes, and holes within pieces within holes.
        std::bernoulli_distribution set(0.05 + 0.9 * (round % 10) / 9.0);
        std::vector<uint16_t> slice(size_t{size.x} * size.y);
        size_t count = 0;
        for (uint16_t& sample : slice) {
            sample = set(random) ? 7 : round % 3 == 0 ? 2 : 0;
            count += sample == 7 ? 1 : 0;
        }
        const std::vector<Outline> outlines = outlines_of(slice, size, 7);
        EXPECT_EQ(outlines.size(), pieces(slice, size, 7));
        double area = 0;
        for (const Outline& outline : outlines) {
            area += area_of(outline);
            EXPECT_GE(outline.size(), 4u);
        }
        EXPECT_EQ(area, static_cast<double>(count)); // of halves and wholes: exact
        const std::vector<float> covered = covered_areas(outlines, size);
        for (size_t i = 0; i < slice.size(); ++i)
            ASSERT_NEAR(covered[i], slice[i] == 7 ? 1.0 : 0.0, 1e-9) << i;
    }
}

TEST(Outlines, HaveNoPointsOnStraightLines) {
    std::vector<uint16_t> slice(20, 1);
    EXPECT_EQ(outlines_of(slice, {5, 4}, 1).front().size(), 4u);
    slice[6] = 0; // a hole: 4 corners, 2 ends of the channel twice, and the 4 outer ones
    const auto outlines = outlines_of(slice, {5, 4}, 1);
    ASSERT_EQ(outlines.size(), 1u);
    EXPECT_EQ(outlines.front().size(), 12u);
    EXPECT_TRUE(outlines_of(slice, {5, 4}, 2).empty());
}

// A star around a centre, in either direction.
Outline star(glm::dvec2 center, double radius, size_t points, bool turned, std::mt19937& random) {
    std::uniform_real_distribution<double> share(0.5, 1.0);
    Outline outline;
    for (size_t i = 0; i < points; ++i) {
        const double angle = 2 * M_PI * double(i) / double(points) * (turned ? -1 : 1);
        outline.push_back(center +
                          radius * share(random) * glm::dvec2(std::cos(angle), std::sin(angle)));
    }
    return outline;
}

// The part of an outline on one side of a line across an axis, at most or at least at `bound`
// (Sutherland and Hodgman, 1974). Edges that run back and forth along the line enclose nothing.
Outline clipped(const Outline& outline, int axis, double bound, double side) {
    Outline out;
    for (size_t i = 0; i < outline.size(); ++i) {
        const glm::dvec2 a = outline[i], b = outline[(i + 1) % outline.size()];
        const double from = side * (a[axis] - bound), to = side * (b[axis] - bound);
        if (from >= 0)
            out.push_back(a);
        if ((from > 0 && to < 0) || (from < 0 && to > 0))
            out.push_back(a + (b - a) * (from / (from - to)));
    }
    return out;
}

double area_within(const Outline& outline, glm::dvec2 sample) {
    Outline part = outline;
    for (int axis = 0; axis < 2; ++axis) {
        part = clipped(part, axis, sample[axis] - 0.5, 1);
        part = clipped(part, axis, sample[axis] + 0.5, -1);
    }
    return std::abs(area_of(part));
}

TEST(CoveredAreas, AreThoseOfPolygonsClippedToEachSample) {
    // A share up to 1 as a float is at most 2^-25 off. A sum in doubles of some twenty edges, with
    // products of coordinates below 10 and a rounding of 2^-53 each, stays below 1e-12.
    constexpr double kRounding = 0x1p-25 + 1e-12;
    std::mt19937 random(9);
    for (int round = 0; round < 200; ++round) {
        const glm::uvec2 size(7, 6);
        // The second lies within the first, the third beside both and partly beyond the slice.
        const std::vector<Outline> outlines{star({2.5, 2.5}, 2.9, 9, round % 2 == 0, random),
                                            star({2.5, 2.5}, 0.6, 5, round % 3 == 0, random),
                                            star({6.2, 5.0}, 0.9, 6, round % 5 == 0, random)};
        const std::vector<float> covered = covered_areas(outlines, size);
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x) {
                const glm::dvec2 at(x, y);
                ASSERT_NEAR(covered[size_t{y} * size.x + x],
                            area_within(outlines[0], at) - area_within(outlines[1], at) +
                                area_within(outlines[2], at),
                            kRounding)
                    << round << ": " << x << " " << y;
            }
    }
}

// Outlines with holes of their own, one within the other and beside each other, as even-odd
// filling of the middles of parts of samples has them. Areas of rectangles with corners at
// multiples of a quarter are sums of parts of a sixteenth.
TEST(CoveredAreas, OfNestedPolygonsAreThoseOfEvenOddFilling) {
    std::mt19937 random(41);
    const glm::uvec2 size(24, 24);
    for (int round = 0; round < 100; ++round) {
        std::vector<Outline> all;
        // Splits a square into parts, and draws a rectangle with a margin in each, down to some
        // depth: no two outlines cross.
        const auto fill = [&](const auto& self, glm::dvec2 low, double side, int depth) -> void {
            const double margin = 0.25 * double(1 + random() % 2);
            const glm::dvec2 a = low + margin, b = low + (side - margin);
            if (!(b.x - a.x >= 0.25))
                return;
            Outline square{{a.x, a.y}, {b.x, a.y}, {b.x, b.y}, {a.x, b.y}};
            if (random() % 2 == 0)
                std::reverse(square.begin(), square.end());
            all.push_back(square);
            if (depth == 0)
                return;
            const double part = std::floor((b.x - a.x) * 2) / 4; // a half, in quarters
            for (int i = 0; i < 4; ++i)
                if (random() % 4 != 0)
                    self(self, a + part * glm::dvec2(i % 2, i / 2), part, depth - 1);
        };
        fill(fill, {-0.5, -0.5}, 24, 3);
        std::shuffle(all.begin(), all.end(), random);
        const std::vector<float> covered = covered_areas(all, size);
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x) {
                int parts = 0;
                for (int i = 0; i < 16; ++i) {
                    const glm::dvec2 at(x - 0.375 + 0.25 * (i % 4), y - 0.375 + 0.25 * (i / 4));
                    bool inside = false; // a rectangle, by its two corners
                    for (const Outline& one : all) {
                        const glm::dvec2 low = glm::min(one[0], one[2]);
                        const glm::dvec2 high = glm::max(one[0], one[2]);
                        inside ^= low.x < at.x && at.x < high.x && low.y < at.y && at.y < high.y;
                    }
                    parts += inside ? 1 : 0;
                }
                ASSERT_EQ(covered[size_t{y} * size.x + x], float(parts) / 16.0f)
                    << round << ": " << x << " " << y;
            }
    }
}

// Triangles about one place, each within the one before: the area is the alternating sum of theirs.
// Each of 4096 samples is rounded to a float below 1, by at most 3e-8: 2e-4 in all, with the sums.
TEST(CoveredAreas, ManyTrianglesWithinEachOtherTakeTurns) {
    constexpr int kCount = 601;
    std::vector<Outline> all;
    double expected = 0.0;
    for (int k = 0; k < kCount; ++k) {
        const double scale = 1.0 - double(k) / kCount;
        const glm::dvec2 middle(31.0, 30.0);
        all.push_back({middle + scale * glm::dvec2(-28.0, -25.0),
                       middle + scale * glm::dvec2(29.0, -20.0),
                       middle + scale * glm::dvec2(-1.0, 30.0)});
        expected += (k % 2 == 0 ? 1.0 : -1.0) * area_of(all.back());
    }
    double sum = 0.0;
    for (const float area : covered_areas(all, {64, 64}))
        sum += double{area};
    EXPECT_NEAR(sum, expected, 2e-4);
}

TEST(CoveredAreas, BeyondTheSliceCountNothing) {
    const Outline square{{-3, -3}, {12, -3}, {12, 12}, {-3, 12}};
    for (const float area : covered_areas(std::vector<Outline>{square}, {4, 3}))
        EXPECT_EQ(area, 1.0f);
    const Outline left{{-9, -1}, {-2, -1.5}, {-3, 4}};
    const Outline right{{9, -1}, {12, -1.5}, {13, 4}};
    for (const float area : covered_areas(std::vector<Outline>{left, right}, {4, 3}))
        EXPECT_NEAR(area, 0.0, 1e-12); // a sum of ten terms below 10
    // Below a slice in y, farther than integers of 64 bits reach.
    const Outline far{{5, 1e20}, {6, 2e20}, {7, 1e300}};
    for (const float area : covered_areas(std::vector<Outline>{far}, {4, 3}))
        EXPECT_EQ(area, 0.0f);
}

} // namespace
} // namespace palpate
