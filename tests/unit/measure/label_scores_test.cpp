#include "engine/measure/label_scores.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "engine/measure/label_shape.h"
#include "engine/volume/builder.h"

namespace palpate {
namespace {

Volume box_at(const Grid& grid, glm::uvec3 low, glm::uvec3 size, double label = 1.0) {
    return make_volume(grid, ScalarType::u8, [=](glm::uvec3 i) {
        return glm::all(glm::greaterThanEqual(i, low)) && glm::all(glm::lessThan(i, low + size))
                   ? label
                   : 0.0;
    });
}

Volume ball(const Grid& grid, double radius_mm) {
    return make_volume(grid, ScalarType::u8, [=](glm::uvec3 i) {
        return glm::length(world_point(grid, glm::dvec3(i))) <= radius_mm ? 1.0 : 0.0;
    });
}

LabelMapScores scores(const Volume& a, const Volume& b, const LabelScoresOptions& options = {}) {
    Result<LabelMapScores> made = label_scores(a, b, options, {});
    EXPECT_TRUE(made);
    return made.value();
}

TEST(LabelScores, OfTwoShiftedBoxesAreThoseOfTheirFormulas) {
    const Grid grid = make_grid({40, 30, 20}, {0.5, 0.8, 2.0});
    // 10 x 12 x 6 samples, shifted by 4 along x: 6 of 10 are common.
    const LabelMapScores found =
        scores(box_at(grid, {8, 6, 4}, {10, 12, 6}), box_at(grid, {12, 6, 4}, {10, 12, 6}),
               {.tolerance_mm = 0.9, .box_margin_mm = 1.0});
    ASSERT_EQ(found.labels.size(), 1u);
    const OverlapScores& o = found.labels[0].overlap;
    EXPECT_DOUBLE_EQ(o.dice(), 0.6);
    EXPECT_DOUBLE_EQ(o.jaccard(), 6.0 / 14.0);
    EXPECT_DOUBLE_EQ(o.voe(), 8.0 / 14.0);
    EXPECT_DOUBLE_EQ(o.rvd().value(), 0.0);
    EXPECT_DOUBLE_EQ(o.sensitivity().value(), 0.6);
    EXPECT_DOUBLE_EQ(o.ppv().value(), 0.6);
    const double frame = 40 * 30 * 20, both = 6 * 12 * 6, one = 10 * 12 * 6;
    EXPECT_DOUBLE_EQ(o.specificity().value(), (frame - 2 * one + both) / (frame - one));
    // The margin is 2, 2 and 1 samples: the box is 14 x 16 x 8, and 8 samples of A along x lie in
    // it.
    const double box = 14 * 16 * 8, in_box = 8 * 12 * 6;
    EXPECT_EQ(o.box, uint64_t(box));
    EXPECT_DOUBLE_EQ(o.box_specificity().value(), (box - in_box - one + both) / (box - one));

    // Cells of the two end faces of A are 4 samples, 2 mm, from B along x, or nearer to its sides:
    // those in the end face that is inside B are at most that far, those outside exactly.
    const SurfaceScores& s = found.labels[0].surface.value();
    EXPECT_FLOAT_EQ(float(s.largest_mm.value()), 2.0f);
    EXPECT_NEAR(s.first_mm2, s.second_mm2, 1e-9 * s.first_mm2);
    EXPECT_GT(s.mean_mm.value(), 0.0);
    EXPECT_LT(s.mean_mm.value(), s.rms_mm.value());
    EXPECT_LE(s.rms_mm.value(), s.p95_mm.value());
}

// The distance of each cell follows from the boxes alone: areas and distances summed by hand.
TEST(SurfaceScores, OfPlatesThatSpanTheVolumeAreTheirDistance) {
    // Two thick plates: their upper faces are 3 samples of 2 mm apart, the lower ones coincide.
    const Grid grid = make_grid({30, 30, 20}, {1.0, 1.5, 2.0});
    const SurfaceScores s = scores(box_at(grid, {0, 0, 4}, {30, 30, 8}),
                                   box_at(grid, {0, 0, 4}, {30, 30, 11}), {.tolerance_mm = 5.9})
                                .labels[0]
                                .surface.value();
    EXPECT_DOUBLE_EQ(s.largest_mm.value(), 6.0);
    // Faces of 29 x 29 whole cells, and the rims: edges are bevelled, corners cut.
    const double face = 29 * 1.0 * 29 * 1.5;
    EXPECT_GT(s.first_mm2, 2 * face);
    EXPECT_LT(s.first_mm2, 2 * (30 * 30 * 1.5) + 2 * (30 * 1.0 + 30 * 1.5) * 8 * 2.0);
}

TEST(SurfaceScores, OfConcentricBallsAreTheDifferenceOfTheirRadii) {
    const Grid grid = make_grid({81, 81, 55}, {0.75, 0.75, 1.1}, {-30, -30, -29.7});
    const double inner = 20.0, outer = 24.0;
    const LabelMapScores found =
        scores(ball(grid, inner), ball(grid, outer), {.tolerance_mm = 6.0});
    const SurfaceScores& s = found.labels[0].surface.value();
    // A crossed cell's centre is within half its diagonal of the sphere, on both sides alike, so
    // every distance is within a diagonal of the difference of radii; the mean, where these cancel
    // but for the choice of the nearest of several, within half of one.
    const double diagonal = glm::length(spacing_mm(grid));
    EXPECT_NEAR(s.mean_mm.value(), outer - inner, 0.5 * diagonal);
    EXPECT_NEAR(s.largest_mm.value(), outer - inner, diagonal);
    EXPECT_GE(s.p95_mm.value(), s.mean_mm.value());
    EXPECT_EQ(s.dice, 1.0);
    // Planes through midpoints of edges have at most the area of a voxel surface (1.5 of the
    // sphere's on average) and at least that of the convex hull of the samples inside.
    const double sphere = 4.0 * std::numbers::pi * inner * inner;
    EXPECT_GT(s.first_mm2, sphere * std::pow((inner - diagonal) / inner, 2));
    EXPECT_LT(s.first_mm2, 1.15 * sphere);
}

TEST(LabelScores, OfEmptySetsAreAsTheHeaderSays) {
    const Grid grid = make_grid({9, 8, 7}, {1, 1, 1});
    const Volume none = box_at(grid, {0, 0, 0}, {0, 0, 0}),
                 some = box_at(grid, {2, 2, 2}, {3, 3, 3});
    const LabelMapScores both = scores(none, none);
    EXPECT_TRUE(both.labels.empty());
    EXPECT_EQ(both.overall.overlap.dice(), 1.0);
    EXPECT_EQ(both.overall.overlap.jaccard(), 1.0);
    EXPECT_EQ(both.overall.overlap.rvd(), 0.0);
    EXPECT_FALSE(both.overall.overlap.sensitivity());
    EXPECT_EQ(both.overall.surface->largest_mm, 0.0);
    EXPECT_EQ(both.overall.surface->dice, 1.0);

    const LabelScores missed = scores(none, some).labels.at(0);
    EXPECT_EQ(missed.overlap.dice(), 0.0);
    EXPECT_EQ(missed.overlap.sensitivity(), 0.0);
    EXPECT_EQ(missed.overlap.rvd(), -1.0);
    EXPECT_FALSE(missed.overlap.ppv());
    EXPECT_FALSE(missed.surface->mean_mm);
    EXPECT_FALSE(missed.surface->largest_mm);
    EXPECT_EQ(missed.surface->dice, 0.0);

    const LabelScores surplus = scores(some, none).labels.at(0);
    EXPECT_FALSE(surplus.overlap.rvd());
    EXPECT_FALSE(surplus.overlap.sensitivity());
    EXPECT_FALSE(surplus.overlap.box_specificity());
    EXPECT_EQ(surplus.overlap.ppv(), 0.0);

    const LabelScores full = scores(some, box_at(grid, {0, 0, 0}, {9, 8, 7})).labels.at(0);
    EXPECT_FALSE(full.overlap.specificity()); // nothing lies outside
}

TEST(LabelScores, OfSeveralLabelsArePutTogetherOnce) {
    const Grid grid = make_grid({20, 20, 20}, {1, 1, 1});
    const Volume a = make_volume(grid, ScalarType::u8, [](glm::uvec3 i) {
        return i.z < 5 ? 0.0 : i.x < 10 ? 3.0 : i.y < 4 ? 7.0 : 9.0;
    });
    const Volume b = make_volume(grid, ScalarType::u8, [](glm::uvec3 i) {
        return i.z < 6 ? 0.0 : i.x < 11 ? 3.0 : 9.0;
    });
    const LabelMapScores found = scores(a, b);
    ASSERT_EQ(found.labels.size(), 3u);
    uint64_t both = 0;
    double area = 0.0;
    for (const LabelScores& one : found.labels) {
        both += one.overlap.both;
        area += one.surface->first_mm2;
    }
    EXPECT_EQ(found.labels[1].label, 7u);
    EXPECT_EQ(found.overall.overlap.both, both);
    EXPECT_NEAR(found.overall.surface->first_mm2, area, 1e-9 * area);
    EXPECT_TRUE(found.overall.surface->mean_mm); // of labels that both have
}

TEST(LabelScores, OfASlantedGridHaveNoSurfaces) {
    Grid grid = make_grid({9, 9, 9}, {1, 1, 1});
    grid.world_from_index[2][0] = 0.3;
    const LabelScores one =
        scores(box_at(grid, {2, 2, 2}, {3, 3, 3}), box_at(grid, {3, 2, 2}, {3, 3, 3})).labels.at(0);
    EXPECT_DOUBLE_EQ(one.overlap.dice(), 2.0 / 3.0);
    EXPECT_FALSE(one.surface);
}

TEST(RunsAgreement, IsTheMeanOfAllPairs) {
    const Grid grid = make_grid({40, 4, 4}, {1, 2, 3});
    const std::vector<Volume> runs{box_at(grid, {0, 0, 0}, {10, 4, 4}),
                                   box_at(grid, {0, 0, 0}, {20, 4, 4}),
                                   box_at(grid, {0, 0, 0}, {40, 4, 4})};
    const Result<std::vector<RunsAgreement>> found = runs_agreement(runs);
    ASSERT_TRUE(found);
    const RunsAgreement& one = found->at(0);
    // Jaccards 1/2, 1/4 and 1/2; volumes in proportion 1, 2, 4.
    EXPECT_EQ(one.runs, 3u);
    EXPECT_DOUBLE_EQ(one.jaccard_mean, 1.25 / 3.0);
    EXPECT_DOUBLE_EQ(one.jaccard_least, 0.25);
    EXPECT_NEAR(one.jaccard_cv.value(), std::sqrt(1.0 / 48.0) / (1.25 / 3.0), 1e-12);
    EXPECT_NEAR(one.volume_mean_mm3, 160.0 * 6.0 * 7.0 / 3.0, 1e-9);
    EXPECT_NEAR(one.volume_cv.value(), std::sqrt(7.0 / 3.0) / (7.0 / 3.0), 1e-12);
    EXPECT_FALSE(runs_agreement({runs[0]}));
}

TEST(LabelShape, OfAnEllipsoidIsItsOwn) {
    const Grid grid = make_grid({61, 61, 61}, {1.0, 1.0, 1.0}, {-30, -30, -30});
    const glm::dvec3 u = glm::normalize(glm::dvec3(2, 1, 0.5));
    const glm::dvec3 v = glm::normalize(glm::cross(u, glm::dvec3(0, 0, 1)));
    const glm::dvec3 w = glm::cross(u, v), semi(24.0, 16.0, 9.0);
    const Volume labels = make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) {
        const glm::dvec3 p = world_point(grid, glm::dvec3(i));
        return glm::length(glm::dvec3(glm::dot(p, u), glm::dot(p, v), glm::dot(p, w)) / semi) <= 1.0
                   ? 4.0
                   : 0.0;
    });
    const LabelStatistics one = label_statistics(labels, nullptr).value().at(0);
    const PrincipalAxes axes = principal_axes(one.covariance_mm2);
    // Voxels along the surface are in or out by up to half a sample, of either sign alike.
    for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(axes.semi_axes_mm[k], semi[k], 0.1) << k;
    EXPECT_GT(std::abs(glm::dot(axes.direction[0], u)), 0.999);
    EXPECT_GT(std::abs(glm::dot(axes.direction[2], w)), 0.999);
}

TEST(LabelShape, OfABallIsRound) {
    const Grid grid = make_grid({61, 61, 31}, {0.8, 0.8, 1.6}, {-24, -24, -24});
    const double radius = 18.0;
    const LabelSurface one = label_surfaces(ball(grid, radius)).value().at(1);
    const double sphere = 4.0 * std::numbers::pi * radius * radius;
    // Vertices stay within 0.875 of a sample's diagonal (half of it, and 0.375) of the sphere.
    const double off = 0.875 * glm::length(spacing_mm(grid)) / radius;
    EXPECT_NEAR(one.area_mm2, sphere, 2.0 * off * sphere);
    EXPECT_LE(one.sphericity, 1.0); // the isoperimetric inequality
    EXPECT_GT(one.sphericity, 0.95);
    EXPECT_EQ(one.note, "");
}

// Lines, sheets and single samples in any direction, of which no smoothed surface is left; beside
// them a plate of two samples.
TEST(LabelShape, ALabelOneSampleThickHasANote) {
    const glm::dvec3 spacing(0.5, 1.0, 2.0);
    const Grid grid = make_grid(glm::uvec3(24), spacing);
    for (int axis = 0; axis < 3; ++axis) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        const auto label = [&](glm::uvec3 at) {
            const bool on_line = at[u] == 4 && at[v] == 4 && at[axis] >= 2 && at[axis] < 20;
            const bool on_sheet = at[axis] == 12 && at[u] >= 8 && at[v] >= 8;
            const bool on_plate = at[axis] >= 16 && at[axis] < 18 && at[u] >= 8 && at[v] >= 8;
            return on_line                      ? 1.0
                   : on_sheet                   ? 2.0
                   : on_plate                   ? 4.0
                   : at == glm::uvec3(22, 1, 1) ? 3.0
                                                : 0.0;
        };
        const auto found = label_surfaces(make_volume(grid, ScalarType::u8, label)).value();
        const glm::dvec3 face(spacing.y * spacing.z, spacing.z * spacing.x, spacing.x * spacing.y);
        const double line = 2.0 * (face[axis] + 18.0 * (face[u] + face[v]));
        const double sheet = 2.0 * (256.0 * face[axis] + 16.0 * (face[u] + face[v]));
        const double sample = 2.0 * (face.x + face.y + face.z);
        for (const auto& [number, faces] : {std::pair(1, line), {2, sheet}, {3, sample}}) {
            const LabelSurface& one = found.at(static_cast<uint16_t>(number));
            EXPECT_EQ(one.note,
                      fmt::format("one sample thick: the area is of a surface that smoothing makes "
                                  "thinner; the faces of the samples have {:g} mm2",
                                  faces));
            EXPECT_LT(one.area_mm2, faces);
        }
        EXPECT_EQ(found.at(4).note, "");
    }
}

} // namespace
} // namespace palpate
