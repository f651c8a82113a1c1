// A method at work for the window.

#include "apps/view/document/segment_run.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "apps/view/document/work.h"
#include "engine/volume/builder.h"

namespace palpate::view {
namespace {

TEST(SegmentTimes, AreThoseOfTheLastRunForSoManySamples) {
    SegmentTimes times;
    EXPECT_EQ(times.expected_s("no such method", 1000), 0.0);
    const double at_first = times.expected_s("random-walker", 1000000);
    EXPECT_GT(at_first, times.expected_s("threshold", 1000000));
    EXPECT_EQ(times.expected_s("random-walker", 2000000), 2.0 * at_first);
    times.note("random-walker", 500, 4.0);
    EXPECT_EQ(times.expected_s("random-walker", 1000), 8.0);
    times.note("random-walker", 0, 4.0); // says nothing
    EXPECT_EQ(times.expected_s("random-walker", 1000), 8.0);
}

// There are two objects: the one that met its boundary is there; the bound is for the other alone.
TEST(SegmentRun, BoundsTheObjectsThatMetNoBoundary) {
    const Grid grid = make_grid({64, 32, 32}, {1, 1, 1});
    const auto at = [](glm::uvec3 i) { return glm::dvec3(i); };
    // A ball of 100 in 0, and behind a wall without data values that are all alike.
    const Volume volume = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
        if (i.x >= 30)
            return i.x < 33 ? std::numeric_limits<double>::quiet_NaN() : 7.0;
        return glm::distance(at(i), glm::dvec3(14, 16, 16)) < 9.0 ? 100.0 + (i.x + i.y) % 3 : 0.0;
    });
    const Volume seeds = make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) {
        return glm::distance(at(i), glm::dvec3(14, 16, 16)) < 3.0   ? 1.0
               : glm::distance(at(i), glm::dvec3(50, 16, 16)) < 3.0 ? 2.0
                                                                    : 0.0;
    });
    Volume labels = make_volume(grid, ScalarType::u8, [](glm::uvec3 i) {
        return i == glm::uvec3(60, 30, 30) ? 2.0 : 0.0; // it was there before
    });
    SegmentJob job{find_segment_method("fast-marching"), {{"rule", 0.0}}, volume, labels, seeds};
    job.label = 1; // has its bound: the other one wants one
    const SegmentDone done = SegmentRun(job, false).take().value().value();
    ASSERT_TRUE(done.strength);
    ASSERT_TRUE(done.strength->is_unbounded);
    EXPECT_EQ(done.strength->of, std::vector<uint16_t>{2});
    EXPECT_EQ(done.labels.value({14, 16, 16}), 1.0f);
    EXPECT_EQ(done.labels.value({14, 20, 16}), 1.0f);
    EXPECT_EQ(done.labels.value({50, 16, 16}), 0.0f);
    EXPECT_EQ(done.labels.value({60, 30, 30}), 2.0f);
    SegmentJob again{job.method, {}, volume, done.labels};
    again.again = done.strength;
    again.again->bound = done.strength->most;
    again.limits.spared = {1};
    const SegmentDone all = SegmentRun(again, false).take().value().value();
    EXPECT_FALSE(all.strength->is_unbounded);
    EXPECT_EQ(all.labels.value({14, 20, 16}), 1.0f);
    EXPECT_EQ(all.labels.value({50, 16, 16}), 2.0f);
    EXPECT_EQ(all.labels.value({60, 30, 30}), 2.0f);
    size_t ones = 0, before = 0;
    for (uint32_t z = 0; z < 32; ++z)
        for (uint32_t y = 0; y < 32; ++y)
            for (uint32_t x = 0; x < 64; ++x) {
                ones += all.labels.value({x, y, z}) == 1.0f;
                before += done.labels.value({x, y, z}) == 1.0f;
            }
    EXPECT_EQ(ones, before);
    // The same bound once more changes nothing, and says so by being the same map.
    again.labels = all.labels;
    EXPECT_TRUE(SegmentRun(again, false).take().value().value().labels.is_same_as(all.labels));
}

// The object in the hand is bounded anew, of several.
TEST(SegmentRun, BoundsTheLabelInTheHand) {
    const Grid grid = make_grid({48, 24, 24}, {1, 1, 1});
    const auto ball = [&](double x, double radius) {
        return [=](glm::uvec3 i) {
            return glm::distance(glm::dvec3(i), glm::dvec3(x, 12, 12)) < radius;
        };
    };
    const Volume volume = make_volume(grid, ScalarType::i16, [&](glm::uvec3 i) {
        return ball(12, 8)(i) || ball(36, 8)(i) ? 100.0 + (i.x + i.y) % 3 : 0.0;
    });
    const Volume seeds = make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) {
        return ball(12, 3)(i) ? 1.0 : ball(36, 3)(i) ? 2.0 : 0.0;
    });
    SegmentJob job{find_segment_method("fast-marching"), {}, volume, empty_labels(grid), seeds};
    job.label = 2;
    const SegmentDone done = SegmentRun(job, false).take().value().value();
    const auto count = [](const Volume& labels, uint16_t label) {
        const auto counts = label_counts(labels);
        const auto found = std::ranges::find(counts, label, &LabelCount::label);
        return found == counts.end() ? 0u : found->count;
    };
    ASSERT_GT(count(done.labels, 1), 100u);
    ASSERT_GT(count(done.labels, 2), 100u);
    ASSERT_EQ(done.strength->of, std::vector<uint16_t>{2});
    SegmentJob again{job.method, {}, volume, done.labels};
    again.again = done.strength;
    again.again->bound = done.strength->least;
    const SegmentDone less = SegmentRun(again, false).take().value().value();
    EXPECT_EQ(count(less.labels, 1), count(done.labels, 1));
    EXPECT_LT(count(less.labels, 2), count(done.labels, 2));
}

// A result that comes while a person goes on drawing is put into the newest labels: what was drawn,
// erased or locked meanwhile stays.
TEST(SegmentRun, AReadyResultLeavesWhatWasDrawnMeanwhile) {
    const Grid grid = make_grid({24, 24, 24}, {1, 1, 1});
    const auto ball = [&](double radius) {
        return make_volume(grid, ScalarType::u8, [=](glm::uvec3 i) {
            return glm::distance(glm::dvec3(i), glm::dvec3(12.0)) < radius ? 1.0 : 0.0;
        });
    };
    const Volume before = make_volume(grid, ScalarType::u8, [](glm::uvec3 i) {
        return i.x == 22 ? 1.0 : i.y == 12 && i.z == 12 && i.x == 8 ? 3.0 : 0.0;
    });
    SegmentJob job{find_segment_method("region-growing"), {}, ball(8.0), before, ball(3.0)};
    SegmentJob later = job;
    later.before = before;
    later.ready =
        std::make_shared<const SegmentDone>(SegmentRun(job, false).take().value().value());
    const Volume& made = later.ready->labels;
    ASSERT_EQ(made.value({12, 12, 12}), 1.0f);
    ASSERT_EQ(made.value({22, 12, 12}), 0.0f); // the label is what the method found
    later.labels = make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) {
        return i.x < 2                       ? 1.0 // drawn meanwhile, of the same label
               : i == glm::uvec3(12, 12, 12) ? 5.0
                                             : double(before.value(i));
    });
    later.limits.spared = {3};
    const Volume both = SegmentRun(later, false).take().value().value().labels;
    for (uint32_t x = 0; x < 24; ++x)
        EXPECT_EQ(both.value({x, 12, 12}), x < 2     ? 1.0f
                                           : x == 12 ? 5.0f
                                           : x == 8  ? 3.0f
                                                     : made.value({x, 12, 12}))
            << x;
}

// While a run with a thread is at work, it shows what it has come to.
TEST(SegmentRun, ShowsWhereItIs) {
    const Grid grid = make_grid({48, 48, 48}, {1, 1, 1});
    const auto ball = [&](double radius) {
        return make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) {
            return glm::distance(glm::dvec3(i), glm::dvec3(24.0)) < radius ? 1.0 : 0.0;
        });
    };
    const Volume volume = ball(18.0), seeds = ball(4.0);
    for (const bool threaded : {true, false})
        for (const char* method : {"fast-marching", "level-set"}) {
            SegmentRun run({find_segment_method(method), {}, volume, empty_labels(grid), seeds},
                           threaded);
            size_t looks = 0;
            std::optional<Result<SegmentDone>> done;
            while (!done) {
                done = run.take();
                if (const std::optional<Volume> look = run.take_look()) {
                    ++looks;
                    EXPECT_EQ(look->grid(), grid);
                    EXPECT_EQ(look->range().max, 1.0f);
                }
            }
            ASSERT_TRUE(*done) << done->error().message;
            EXPECT_EQ(looks > 0, threaded) << method;
        }
}

} // namespace
} // namespace palpate::view
