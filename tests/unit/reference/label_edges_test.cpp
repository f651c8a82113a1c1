// Smooth edges of labels on slices: where they run, and how wide their lines are.

#include "engine/reference/label_edges.h"

#include <gtest/gtest.h>

#include <random>

namespace palpate::reference {
namespace {

// A disc's samples have the label where their middle lies inside. An edge crosses a line between
// two samples in its middle, and the circle crosses the same line: they are half a sample apart at
// most there. Between two such lines the edge is nearly straight, and the circle bends by
// 1 / (8 r) of a sample.
TEST(LabelEdges, OfADiscLieWithinHalfASampleOfTheCircle) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    double worst = 0.0, worst_of_voxels = 0.0;
    for (int disc = 0; disc < 10; ++disc) {
        const double radius = 4.0 + 12.0 * share(random);
        const glm::dvec2 middle(20.0 + share(random), 20.0 + share(random));
        const auto label_of = [&](glm::ivec3 at) {
            return glm::length(glm::dvec2(at.x, at.y) - middle) < radius ? 7u : 0u;
        };
        for (int i = 0; i < 360; ++i) {
            const double angle = glm::radians(1.0 * i);
            for (double r = radius - 1.5; r < radius + 1.5; r += 0.01) {
                const glm::dvec3 at(middle + r * glm::dvec2(std::cos(angle), std::sin(angle)), 4.0);
                const bool inside = label_place(label_of, at).label == 7;
                const bool in_voxel = label_of(glm::ivec3(glm::round(at))) == 7;
                worst = std::max(worst, inside ? r - radius : radius - r);
                worst_of_voxels = std::max(worst_of_voxels, in_voxel ? r - radius : radius - r);
            }
        }
        EXPECT_LE(worst, 0.5 + 1.0 / (8.0 * radius) + 0.01) << radius;
    }
    EXPECT_GT(worst_of_voxels, 0.65); // half the diagonal of a sample: the staircase
    std::printf("    smooth %.3f samples, voxels %.3f\n", worst, worst_of_voxels);
}

TEST(LabelEdges, TheMiddleOfASampleHasItsLabel) {
    std::mt19937 random(3);
    std::vector<uint32_t> labels(6 * 6 * 6);
    for (uint32_t& label : labels)
        label = random() % 4;
    const auto label_of = [&](glm::ivec3 at) {
        return at == glm::clamp(at, glm::ivec3(0), glm::ivec3(5))
                   ? labels[static_cast<size_t>(at.x + 6 * (at.y + 6 * at.z))]
                   : 0u;
    };
    for (int z = 0; z < 6; ++z)
        for (int y = 0; y < 6; ++y)
            for (int x = 0; x < 6; ++x) {
                const LabelPlace place = label_place(label_of, {x, y, z});
                EXPECT_EQ(place.label, label_of({x, y, z}));
                EXPECT_EQ(place.margin, 1.0);
            }
    // Elsewhere the margin is that of the weights, and its slope that of small steps.
    for (int i = 0; i < 200; ++i) {
        const glm::dvec3 at =
            5.0 * glm::dvec3(random() % 1000, random() % 1000, random() % 1000) / 1000.0 + 0.00031;
        const LabelPlace place = label_place(label_of, at);
        EXPECT_GE(place.margin, 0.0);
        for (int axis = 0; axis < 3; ++axis) {
            glm::dvec3 aside(0.0);
            aside[axis] = 1e-7;
            const LabelPlace low = label_place(label_of, at - aside),
                             high = label_place(label_of, at + aside);
            if (low.label != high.label || low.other != high.other)
                continue;
            EXPECT_NEAR((high.margin - low.margin) / 2e-7, place.slope[axis], 1e-5);
        }
    }
}

// Across a straight wall the margin falls by two a sample, so that margin over slope is the
// distance from the wall; the line of each label is as wide as it should be.
TEST(LabelEdges, DepthIsTheDistanceAndTheLineHasItsWidth) {
    const auto label_of = [](glm::ivec3 at) { return at.x < 3 ? 1u : 2u; };
    for (double x = 2.05; x < 3.0; x += 0.1) {
        const LabelPlace place = label_place(label_of, {x, 0.3, 0.7});
        EXPECT_EQ(place.label, x < 2.5 ? 1u : 2u);
        EXPECT_EQ(place.other, x < 2.5 ? 2u : 1u);
        EXPECT_NEAR(place.margin / glm::length(place.slope), std::abs(x - 2.5), 1e-12);
    }
    const double fill = 0.25, outline_px = 1.75, step = 1.0 / 64.0;
    double width = 0.0;
    for (double depth = 0.5 * step; depth < 5.0; depth += step)
        width += (label_cover(1, depth, false, outline_px, fill) - fill) / (1.0 - fill) * step;
    EXPECT_NEAR(width, outline_px, step);
    EXPECT_EQ(label_cover(1, 0.0, true, 0.0, fill), fill) << "no line";
    EXPECT_EQ(label_cover(0, 0.0, true, 1.0, fill), 0.0) << "background";
}

} // namespace
} // namespace palpate::reference
