// Changes of one label as a whole: the label changes as it should, and nothing else does.

#include "apps/view/document/label_changes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "engine/segment/interpolate_slices.h"
#include "engine/volume/builder.h"

namespace palpate::view {
namespace {

constexpr uint32_t kSide = 30;

template <class At>
Volume labelled(At at, glm::dvec3 spacing_mm = {1.0, 1.0, 1.0}) {
    return make_volume(make_grid(glm::uvec3(kSide), spacing_mm, glm::dvec3(0.0)), ScalarType::u8,
                       [&](glm::uvec3 i) { return static_cast<double>(at(i)); });
}

template <class Visit>
void for_each_sample(Visit visit) {
    for (uint32_t z = 0; z < kSide; ++z)
        for (uint32_t y = 0; y < kSide; ++y)
            for (uint32_t x = 0; x < kSide; ++x)
                visit(glm::uvec3(x, y, z));
}

Volume changed(const char* id, const Volume& before, uint16_t label, double by_mm = 1.0) {
    return label_change(id).change(before, {label, by_mm}, {}).value();
}

// Three balls with ragged surfaces that touch, and grains everywhere.
Volume ragged(uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> any(0.0, 1.0);
    const glm::dvec3 middles[] = {{9, 9, 12}, {20, 11, 14}, {13, 21, 17}};
    return labelled([&](glm::uvec3 i) {
        if (any(random) < 0.002)
            return 1 + static_cast<int>(3 * any(random));
        for (int n = 0; n < 3; ++n)
            if (glm::distance(glm::dvec3(i), middles[n]) < 6.5 + 1.5 * any(random))
                return n + 1;
        return 0;
    });
}

TEST(LabelChanges, NoOtherLabelLosesOrGainsASample) {
    for (uint32_t seed = 1; seed <= 3; ++seed) {
        const Volume before = ragged(seed);
        for (const LabelChange& change : label_changes())
            for (uint16_t label = 1; label <= 3 && !change.changes_others; ++label) {
                const glm::uvec3 middle[] = {{9, 9, 12}, {20, 11, 14}, {13, 21, 17}};
                const Volume after =
                    change.change(before, {label, 2.1, {}, middle[label - 1]}, {}).value();
                size_t odd = 0;
                for_each_sample([&](glm::uvec3 i) {
                    const float was = before.value(i), is = after.value(i);
                    const auto own = static_cast<float>(label);
                    odd += was != is && !(was == 0.0f && is == own) && !(was == own && is == 0.0f);
                });
                EXPECT_EQ(odd, 0u) << change.id << " of " << label << ", seed " << seed;
            }
    }
}

// Those that change others leave locked ones, and every other change is of samples that had labels
// that are not locked.
TEST(LabelChanges, OfOthersLeaveLockedOnes) {
    const uint16_t locked[] = {2};
    const Volume before = ragged(4);
    size_t many = 0;
    for (const LabelChange& change : label_changes()) {
        if (!change.changes_others)
            continue;
        ++many;
        const Volume after = change.change(before, {1, 1.7, locked, {13, 21, 17}}, {}).value();
        size_t odd = 0, changed = 0;
        for_each_sample([&](glm::uvec3 i) {
            const float was = before.value(i), is = after.value(i);
            odd += (was == 2.0f) != (is == 2.0f);
            changed += was != is;
        });
        EXPECT_EQ(odd, 0u) << change.id;
        EXPECT_GT(changed, 0u) << change.id;
    }
    EXPECT_EQ(many, 3u);
}

TEST(LabelChanges, OfWhatIsAtTheCrosshair) {
    const Volume before = labelled([](glm::uvec3 i) {
        return i.y < 9 || i.y > 20 ? 0 : i.x < 6 || i.x > 22 ? 1 : i.x > 9 && i.x < 14 ? 2 : 0;
    });
    const auto after = [&](const char* id, glm::uvec3 at) {
        return label_change(id).change(before, {1, 1.0, {}, at}, {});
    };
    EXPECT_EQ(after("piece", {24, 15, 3})->value({2, 15, 3}), 0.0f);
    EXPECT_EQ(after("piece", {24, 15, 3})->value({24, 15, 9}), 1.0f);
    EXPECT_FALSE(after("piece", {12, 15, 3}));
    EXPECT_EQ(after("add", {12, 15, 3})->value({11, 15, 9}), 1.0f);
    EXPECT_FALSE(after("add", {2, 15, 3}));
    EXPECT_EQ(after("split", {})->value({2, 15, 3}), 3.0f); // 24 .. 29 are more
    EXPECT_EQ(after("split", {})->value({25, 15, 3}), 1.0f);
    EXPECT_EQ(after("invert", {})->value({7, 15, 3}), 1.0f);
    EXPECT_EQ(after("invert", {})->value({2, 15, 3}), 0.0f);
}

// A sample changes by what lies within the distance of it, one by one; on unequal spacings.
TEST(LabelChanges, GrowAndShrinkGoSoFar) {
    const glm::dvec3 spacing(0.8, 1.0, 1.7);
    std::mt19937 random(5);
    const Volume before = labelled(
        [&](glm::uvec3 i) {
            const double r = glm::distance(glm::dvec3(i) * spacing, glm::dvec3(12, 14, 24));
            return r < 7.0 ? 1 : r < 9.0 && random() % 3 == 0 ? 2 : 0;
        },
        spacing);
    for (const double by_mm : {0.9, 2.0, 3.3}) {
        const Volume grown = changed("grow", before, 1, by_mm),
                     shrunk = changed("shrink", before, 1, by_mm);
        const glm::ivec3 reach(glm::ceil(by_mm / spacing));
        size_t wrong = 0;
        for_each_sample([&](glm::uvec3 at) {
            bool meets = false, stays = true;
            for (int z = -reach.z; z <= reach.z; ++z)
                for (int y = -reach.y; y <= reach.y; ++y)
                    for (int x = -reach.x; x <= reach.x; ++x) {
                        const glm::ivec3 there = glm::ivec3(at) + glm::ivec3(x, y, z);
                        if (glm::length(glm::dvec3(x, y, z) * spacing) > by_mm * (1.0 + 1e-9) ||
                            glm::any(glm::lessThan(there, glm::ivec3(0))) ||
                            glm::any(glm::greaterThanEqual(there, glm::ivec3(kSide))))
                            continue;
                        const bool is_one = before.value(glm::uvec3(there)) == 1.0f;
                        meets |= is_one;
                        stays &= is_one;
                    }
            const float was = before.value(at);
            wrong += grown.value(at) != (was == 0.0f && meets ? 1.0f : was);
            wrong += shrunk.value(at) != (was == 1.0f && !stays ? 0.0f : was);
        });
        EXPECT_EQ(wrong, 0u) << by_mm << " mm";
    }
}

// Equal discs in two slices: each slice between has the same disc, whichever way they lie.
TEST(LabelChanges, BetweenEqualSlicesLieEqualSlices) {
    for (int axis = 0; axis < 3; ++axis) {
        const auto in_disc = [&](glm::uvec3 i) {
            glm::dvec3 from = glm::dvec3(i) - glm::dvec3(14.0);
            from[axis] = 0.0;
            return glm::length(from) < 6.3;
        };
        const Volume before = labelled([&](glm::uvec3 i) {
            return (i[axis] == 5 || i[axis] == 12 || i[axis] == 20) && in_disc(i) ? 4 : 0;
        });
        EXPECT_EQ(axis_with_gaps(before, 4), axis);
        EXPECT_EQ(axis_with_gaps(before, 3), -1);
        const Volume after = changed("between", before, 4);
        size_t wrong = 0;
        for_each_sample([&](glm::uvec3 i) {
            const bool is_within = i[axis] >= 5 && i[axis] <= 20 && in_disc(i);
            wrong += after.value(i) != (is_within ? 4.0f : 0.0f);
        });
        EXPECT_EQ(wrong, 0u) << "axis " << axis;
    }
}

TEST(LabelChanges, SmoothingKeepsTheVolumeAndLosesSurface) {
    const Volume before = labelled([](glm::uvec3 i) {
        const glm::dvec3 from = glm::dvec3(i) - glm::dvec3(14.5);
        const double bumps =
            std::sin(2.1 * from.x) * std::sin(1.9 * from.y) * std::sin(2.3 * from.z);
        return glm::length(from) < 9.0 + 1.5 * bumps ? 1 : 0;
    });
    const Volume after = changed("smooth", before, 1, 1.5);
    const auto count = [](const Volume& labels) {
        size_t samples = 0, faces = 0;
        for_each_sample([&](glm::uvec3 i) {
            if (labels.value(i) == 0.0f)
                return;
            ++samples;
            for (int axis = 0; axis < 3; ++axis)
                for (const int by : {-1, 1}) {
                    glm::ivec3 beside(i);
                    beside[axis] += by;
                    faces += labels.value(glm::uvec3(beside)) == 0.0f;
                }
        });
        return std::pair(samples, faces);
    };
    const auto [samples, faces] = count(before);
    const auto [smooth_samples, smooth_faces] = count(after);
    // smooth_labels() keeps a label's samples to 0.1 % or one.
    EXPECT_NEAR(static_cast<double>(smooth_samples), static_cast<double>(samples),
                std::max(1.0, 1e-3 * static_cast<double>(samples)));
    EXPECT_LT(smooth_faces, faces);
    // A ball of that volume has six silhouettes of pi r^2. A digital one lacks up to some r^(2/3)
    // of each, 2 % here, and remains of the bumps add to it.
    const double pi = std::acos(-1.0),
                 r = std::cbrt(3.0 * static_cast<double>(smooth_samples) / (4.0 * pi)),
                 ball = 6.0 * pi * r * r;
    EXPECT_NEAR(static_cast<double>(smooth_faces), ball, 0.05 * ball);
}

TEST(LabelChanges, TheLargestPieceAndHolesAreThoseOfTheLabel) {
    const Volume before = labelled([](glm::uvec3 i) {
        const double r = glm::distance(glm::dvec3(i), glm::dvec3(12.0));
        return r < 2.0 ? 0 : r < 6.0 ? 1 : i == glm::uvec3(25, 25, 25) ? 1 : 0;
    });
    EXPECT_EQ(changed("largest", before, 1).value({25, 25, 25}), 0.0f);
    EXPECT_EQ(changed("largest", before, 1).value({12, 12, 12}), 0.0f);
    EXPECT_EQ(changed("fill", before, 1).value({12, 12, 12}), 1.0f);
    EXPECT_EQ(changed("fill", before, 1).value({25, 25, 25}), 1.0f);
}

} // namespace
} // namespace palpate::view
