#include "engine/segment/methods.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "engine/segment/arrival_threshold.h"
#include "engine/segment/edges.h"
#include "engine/segment/march_cost.h"
#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"

namespace palpate {
namespace {

using testing::HasSubstr;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// A ball of 100 in 0, with noise of 5, on slices of 2 mm.
Volume noisy_ball() {
    const Grid grid = make_grid({50, 50, 26}, {1, 1, 2}, {-24.5, -24.5, -25});
    return synthetic::sample(synthetic::sphere({}, 15.0, 0.5, 100.0, 0.0), grid, ScalarType::i16,
                             5.0);
}

double dice_with_ball(const Volume& labels, double radius_mm) {
    double both = 0, first = 0, second = 0;
    for (uint32_t z = 0; z < labels.size().z; ++z)
        for (uint32_t y = 0; y < labels.size().y; ++y)
            for (uint32_t x = 0; x < labels.size().x; ++x) {
                const bool truth = glm::length(world_point(labels.grid(), {x, y, z})) <= radius_mm;
                const bool found = labels.value({x, y, z}) == 1.0f;
                both += truth && found, first += found, second += truth;
            }
    return 2.0 * both / (first + second);
}

// About the origin, across an axis.
WireCurve circle(int axis, double radius_mm) {
    WireCurve curve;
    for (int i = 0; i <= 12; ++i) {
        const double angle = i * M_PI / 6.0;
        glm::dvec3 at(0.0);
        at[(axis + 1) % 3] = radius_mm * std::cos(angle);
        at[(axis + 2) % 3] = radius_mm * std::sin(angle);
        curve.points_mm.push_back(at);
    }
    return curve;
}

// Methods takes over 5 s of a processor: each method runs on a whole volume, and some of them
// twice.
TEST(Methods, EachFindsANoisyBall) {
    const Volume volume = noisy_ball();
    const SeedBall balls[] = {{1, {0, 0, 0}, 5.0}, {2, {20, 20, 20}, 4.0}};
    const Result<Volume> seeds = seed_map(volume, balls);
    ASSERT_TRUE(seeds);
    for (const SegmentMethod& method : segment_methods()) {
        SegmentInput input{volume, *seeds, {std::begin(balls), std::end(balls)}, 2};
        for (int axis = 0; axis < 3 && method.takes_curves; ++axis)
            input.curves.push_back(circle(axis, 15.0));
        ParameterValues values;
        if (std::string_view(method.name) == "threshold")
            values["low"] = 50.0;
        if (std::string_view(method.name) == "region-growing")
            values["deviations"] = 4.0;
        if (std::string_view(method.name) == "random-walker")
            values["tolerance"] = 1e-2;
        if (std::string_view(method.name) == "simplex-mesh") // from 5 mm to 15, beyond noise
            values = {{"edges", 14.0}, {"rigidity", 8.0}, {"subdivisions", 3.0}, {"steps", 150.0}};
        if (std::string_view(method.name) == "level-set")
            values["deviations"] = 6.0; // of noise of 5: to 30 from 100
        const Result<Segmented> made = segment(method, input, values, {});
        ASSERT_TRUE(made) << method.name << ": " << made.error().message;
        // A sample of surface more or less is a Dice of 0.9. A front that slows down in an edge
        // stops before it, and edges are two samples wide: at 13 of 15 mm Dice is 0.79.
        const bool before_edges = std::string_view(method.name).starts_with("fast-marching");
        EXPECT_GE(dice_with_ball(made->labels, 15.0), before_edges ? 0.78 : 0.9) << method.name;
        EXPECT_EQ(made->labels.range().max, 1.0f) << method.name;
        EXPECT_EQ(made->strength.has_value(), method.strength.has_value()) << method.name;
        EXPECT_EQ(made->distance.has_value(), method.has_distance) << method.name;
        if (made->strength) { // none at the seeds outside
            EXPECT_TRUE(std::isnan(made->strength->value({44, 44, 22}))) << method.name;
        }
    }
}

TEST(Methods, AKeptRunGoesOnToWhatANewOneGives) {
    const Volume volume = noisy_ball();
    const SegmentMethod& method = *find_segment_method("grow-from-seeds");
    std::vector<SeedBall> balls{{1, {0, 0, 0}, 5.0}, {2, {20, 20, 20}, 4.0}};
    std::shared_ptr<KeptRun> kept;
    const KeptRun* first = nullptr;
    for (const SeedBall& more : {SeedBall{1, {9, 0, 0}, 2.0}, SeedBall{3, {-6, 0, 0}, 3.0}}) {
        balls.push_back(more);
        const Volume seeds = *seed_map(volume, balls);
        SegmentInput input{volume, seeds, balls, 2};
        const Result<Segmented> fresh = segment(method, input, {}, {});
        input.kept = &kept;
        const Result<Segmented> made = segment(method, input, {}, {});
        ASSERT_TRUE(fresh);
        ASSERT_TRUE(made);
        ASSERT_NE(kept, nullptr);
        EXPECT_TRUE(first == nullptr || first == kept.get());
        first = kept.get();
        for (uint32_t z = 0; z < volume.size().z; ++z)
            for (uint32_t y = 0; y < volume.size().y; ++y)
                for (uint32_t x = 0; x < volume.size().x; ++x)
                    ASSERT_EQ(made->labels.value({x, y, z}), fresh->labels.value({x, y, z}));
    }
    // Another height is another forest, and a method that keeps nothing frees it.
    SegmentInput input{volume, *seed_map(volume, balls), balls, 2};
    input.kept = &kept;
    const std::shared_ptr<KeptRun> before = kept;
    ASSERT_TRUE(segment(method, input, {{"height", 1.0}}, {}));
    EXPECT_NE(kept, before);
    ASSERT_TRUE(segment(*find_segment_method("watershed"), input, {}, {}));
    EXPECT_EQ(kept, nullptr);
}

// Two balls, two objects, and what is none: another bound gives what the method gives with it.
TEST(Methods, AnotherBoundNeedsNoOtherRun) {
    const Volume volume = noisy_ball();
    const SeedBall balls[] = {{1, {-6, 0, 0}, 3.0}, {3, {7, 0, 0}, 3.0}, {2, {20, 20, 20}, 4.0}};
    const Volume seeds = *seed_map(volume, balls);
    const SegmentInput input{volume, seeds, {}, 2};
    for (const char* name : {"fast-marching", "fast-marching-edges", "fuzzy-connectedness"}) {
        const SegmentMethod& method = *find_segment_method(name);
        const Result<Segmented> made = segment(method, input, {}, {});
        ASSERT_TRUE(made) << name << ": " << made.error().message;
        ASSERT_TRUE(made->owner) << name;
        for (const double bound : {0.0, 0.03, 0.3, 0.7, 30.0}) {
            const bool is_share = !is_object_below(method);
            if (is_share && bound > 1.0)
                continue;
            const Result<Segmented> other = segment(method, input, {{"threshold", bound}}, {});
            ASSERT_TRUE(other) << name << ": " << other.error().message;
            const Result<Volume> again =
                bounded_labels(*made->strength, *made->owner, is_object_below(method), bound, {});
            ASSERT_TRUE(again) << name << ": " << again.error().message;
            size_t differences = 0;
            for (uint32_t z = 0; z < 26; ++z)
                for (uint32_t y = 0; y < 50; ++y)
                    for (uint32_t x = 0; x < 50; ++x)
                        differences += again->value({x, y, z}) != other->labels.value({x, y, z});
            EXPECT_EQ(differences, 0u) << name << " " << bound;
        }
    }
    const Volume other_grid = make_volume(make_grid({4, 4, 4}, {1, 1, 1}), ScalarType::f32,
                                          [](glm::uvec3) { return 1.0; });
    EXPECT_FALSE(bounded_labels(other_grid, seeds, true, 1.0, {}));
}

// In values that are alike everywhere no boundary is met: an error that says how the front grows,
// or its times, for a person to choose from.
TEST(Methods, AFrontWithoutABoundaryTellsItsTimes) {
    const Volume even = make_volume(make_grid({40, 40, 40}, {1, 1, 1}), ScalarType::u8,
                                    [](glm::uvec3) { return 7.0; });
    const SeedBall ball[] = {{1, {20, 20, 20}, 2.0}};
    const Volume seeds = *seed_map(even, ball);
    const SegmentMethod& method = *find_segment_method("fast-marching");
    SegmentInput input{even, seeds, {}, 0};
    const ParameterValues printed{{"rule", 0.0}}; // the cost of the band, which is one everywhere
    const Result<Segmented> refused = segment(method, input, printed, {});
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message,
                HasSubstr("label 1: the front met no boundary that tells it to stop: choose a "
                          "threshold of its arrival times; it covers 0.1 % of the volume by "));
    input.keeps_unbounded = true;
    const Result<Segmented> made = segment(method, input, printed, {});
    ASSERT_TRUE(made) << made.error().message;
    ASSERT_EQ(made->unbounded.size(), 1u);
    EXPECT_EQ(made->unbounded[0].label, 1);
    EXPECT_EQ(made->unbounded[0].why, refused.error().message);
    EXPECT_EQ(made->labels.range().max, 0.0f);
    EXPECT_FALSE(made->found.contains("threshold"));
    // At the time that is told for a tenth, a tenth has arrived; a band of times before it, less.
    const std::string& told = made->unbounded[0].why;
    const double tenth = std::stod(told.substr(told.find(", 10 % by ") + 10));
    const auto share_by = [&](double time) {
        double count = 0.0;
        const Volume labels = *bounded_labels(*made->strength, *made->owner, true, time, {});
        for (uint32_t z = 0; z < 40; ++z)
            for (uint32_t y = 0; y < 40; ++y)
                for (uint32_t x = 0; x < 40; ++x)
                    count += labels.value({x, y, z}) == 1.0f;
        return count / 64000.0;
    };
    EXPECT_GE(share_by(1.005 * tenth), 0.1); // three digits are told
    EXPECT_LT(share_by(tenth / kGrowthRatio / 1.005), 0.1);
    // With a threshold there is nothing to complain of.
    const Result<Segmented> bounded = segment(method, input, {{"threshold", tenth}}, {});
    ASSERT_TRUE(bounded);
    EXPECT_TRUE(bounded->unbounded.empty());
}

// A value that a method found has the parameter's name, and gives the same if it is given.
TEST(Methods, WhatWasFoundCanBeGiven) {
    const Volume volume = noisy_ball();
    const SeedBall balls[] = {{1, {0, 0, 0}, 5.0}, {2, {20, 20, 20}, 4.0}};
    const Volume seeds = *seed_map(volume, balls);
    const SegmentInput input{volume, seeds, {}, 2};
    for (const auto& [name, parameters] : std::map<std::string, std::vector<std::string>>{
             {"region-growing", {"low", "high"}},
             {"fast-marching", {"threshold"}},
             {"fast-marching-edges", {"threshold"}},
             {"fuzzy-connectedness", {"homogeneity"}},
             {"random-walker", {"homogeneity"}},
             {"level-set", {"low", "high", "curvature", "change"}},
             {"level-set-edges", {"edge", "curvature", "change"}}}) {
        const SegmentMethod& method = *find_segment_method(name);
        const Result<Segmented> made = segment(method, input, {}, {});
        ASSERT_TRUE(made) << name << ": " << made.error().message;
        ParameterValues given;
        for (const std::string& parameter : parameters) {
            ASSERT_TRUE(made->found.contains(parameter)) << name << " " << parameter;
            given[parameter] = made->found.at(parameter);
        }
        const Result<Segmented> again = segment(method, input, given, {});
        ASSERT_TRUE(again) << name << ": " << again.error().message;
        size_t differences = 0;
        for (uint32_t z = 0; z < 26; ++z)
            for (uint32_t y = 0; y < 50; ++y)
                for (uint32_t x = 0; x < 50; ++x)
                    differences += again->labels.value({x, y, z}) != made->labels.value({x, y, z});
        EXPECT_EQ(differences, 0u) << name;
    }
}

TEST(Methods, RefuseWhatDoesNotFit) {
    const Volume volume = noisy_ball();
    const auto why = [&](const char* name, const ParameterValues& values,
                         std::optional<Volume> seeds = {}) {
        const Result<Segmented> made =
            segment(*find_segment_method(name), {volume, std::move(seeds), {}, 0}, values, {});
        return made ? "" : made.error().message;
    };
    EXPECT_EQ(find_segment_method("magic"), nullptr);
    EXPECT_THAT(why("threshold", {}), HasSubstr("expected low, high or both"));
    EXPECT_THAT(why("threshold", {{"order", 2}}), HasSubstr("has no parameter order"));
    EXPECT_THAT(why("watershed", {}), HasSubstr("expected seeds"));
    EXPECT_THAT(why("live-wire-surface", {}), HasSubstr("expected closed curves"));
    const SeedBall ball[] = {{1, {0, 0, 0}, 5.0}};
    const Volume seeds = *seed_map(volume, ball);
    EXPECT_THAT(why("watershed", {{"neighbors", 7}}, seeds), HasSubstr("6, 18 or 26, found 7"));
    EXPECT_THAT(why("fuzzy-connectedness", {{"weight", 2}}, seeds), HasSubstr("0 .. 1, found 2"));
    EXPECT_THAT(why("level-set-regions", {}, seeds), HasSubstr("expected seeds outside"));
    EXPECT_THAT(why("level-set", {{"low", 9}, {"high", 8}}, seeds), HasSubstr("found 9 .. 8"));
}

TEST(EdgeStrength, IsTheSlopeOfARampOnAnyGridAndNoDataDoesNotSpread) {
    Grid grid = make_grid({40, 9, 5}, {0.5, 0.7, 3.0}, {1, 2, 3});
    grid.world_from_index[1] += 0.4 * grid.world_from_index[0]; // sheared
    const glm::dvec3 slope(3.0, -2.0, 0.5);
    const Volume ramp = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
        return i == glm::uvec3(33, 4, 2) ? kNone
                                         : glm::dot(slope, world_point(grid, glm::dvec3(i)));
    });
    const Result<Volume> edges = edge_strength(ramp, {});
    ASSERT_TRUE(edges);
    for (uint32_t z = 0; z < 5; ++z)
        for (uint32_t y = 0; y < 9; ++y)
            for (uint32_t x = 0; x < 40; ++x) {
                if (glm::uvec3(x, y, z) == glm::uvec3(33, 4, 2)) {
                    EXPECT_TRUE(std::isnan(edges->value({x, y, z})));
                    continue;
                }
                // Values up to 90 as floats, over steps of 0.5 mm.
                EXPECT_NEAR(edges->value({x, y, z}), glm::length(slope), 1e-4);
            }
    const Volume one = make_volume(make_grid({1, 1, 1}, {1, 1, 1}), ScalarType::u8,
                                   [](glm::uvec3) { return 9.0; });
    EXPECT_EQ(edge_strength(one, {})->value({0, 0, 0}), 0.0f);
}

TEST(MarchCost, IsItsFormula) {
    const Grid grid = make_grid({4, 1, 1}, {1, 1, 1});
    const Volume volume = make_volume(grid, ScalarType::f32, [](glm::uvec3 i) {
        return i.x < 2 ? 10.0 : i.x == 2 ? 16.0 : kNone;
    });
    const SeedValues seeds{1, 9, 10.0, 2.0};
    const Result<Volume> plain = statistics_cost(volume, seeds, {1.5, 0.1, 0}, {});
    ASSERT_TRUE(plain);
    EXPECT_FLOAT_EQ(plain->value({0, 0, 0}), 0.1f);
    EXPECT_FLOAT_EQ(plain->value({2, 0, 0}), 0.1f + 4.0f);
    EXPECT_TRUE(std::isnan(plain->value({3, 0, 0})));
    // Smoothed: 10, (10 + 20 + 16) / 4 = 11.5, (10 + 32) / 3 = 14.
    const Result<Volume> smooth = statistics_cost(volume, seeds, {1.5, 0.1, 1}, {});
    ASSERT_TRUE(smooth);
    EXPECT_FLOAT_EQ(smooth->value({0, 0, 0}), 0.1f);
    EXPECT_FLOAT_EQ(smooth->value({1, 0, 0}), 0.1f + 0.25f);
    EXPECT_FLOAT_EQ(smooth->value({2, 0, 0}), 0.1f + 16.0f / 9.0f);
    EXPECT_TRUE(std::isnan(smooth->value({3, 0, 0})));
    const Result<Volume> edges = edge_cost(volume, 3.0, {});
    ASSERT_TRUE(edges);
    EXPECT_FLOAT_EQ(edges->value({2, 0, 0}), float(std::exp(6.0 / 3.0)));
}

} // namespace
} // namespace palpate
