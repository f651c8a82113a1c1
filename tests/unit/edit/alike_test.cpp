// The edge-aware brush: its twin by brute force, its range of values, edges that hold it.

#include "engine/edit/alike.h"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include "engine/edit/stroke_run.h"
#include "engine/volume/changes.h"
#include "tests/unit/edit/twin.h"

namespace palpate {
namespace {

struct Range {
    double low, high;
};

double middle_of(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    const size_t n = values.size();
    return n % 2 ? values[n / 2] : (values[n / 2 - 1] + values[n / 2]) / 2.0;
}

glm::ivec3 nearest(const Grid& grid, glm::dvec3 point_mm) {
    return glm::ivec3(
        glm::round(glm::dvec3(glm::inverse(grid.world_from_index) * glm::dvec4(point_mm, 1.0))));
}

Range range_around(const FlatVolume& greys, glm::ivec3 at, double deviations) {
    std::vector<double> values;
    greys.for_each([&](glm::ivec3 i) {
        if (glm::all(glm::lessThanEqual(glm::abs(i - at), glm::ivec3(2))) && !std::isnan(greys[i]))
            values.push_back(greys[i]);
    });
    const double m = middle_of(values);
    for (double& v : values)
        v = v < m ? m - v : v - m;
    const double reach = deviations * 1.4826 * middle_of(values);
    return {m - reach, m + reach};
}

// T by the definition: looks at the tool one after the other, each a search over the whole volume.
std::vector<bool> brute_alike(const FlatVolume& greys, const Tool& tool, double deviations,
                              const std::vector<StrokePose>& poses) {
    const Grid& grid = greys.grid;
    std::vector<bool> t(greys.values.size());
    const glm::ivec3 first = nearest(grid, poses.front().tool.position_mm);
    if (!greys.has(first))
        return t;
    const Range range = range_around(greys, first, deviations);
    const auto is_alike = [&](glm::ivec3 i) {
        return greys[i] >= range.low && greys[i] <= range.high;
    };
    const auto look = [&](const StrokePose& pose) {
        const glm::ivec3 origin = nearest(grid, pose.tool.position_mm);
        if (!greys.has(origin) || !is_alike(origin))
            return;
        std::vector<glm::ivec3> candidates;
        greys.for_each([&](glm::ivec3 i) {
            if (is_alike(i) && holds(tool, grid, pose, pose, i))
                candidates.push_back(i);
        });
        std::vector<bool> here(t.size());
        here[greys.at(origin)] = true;
        for (bool grown = true; grown;) { // layer by layer
            grown = false;
            for (const glm::ivec3 i : candidates)
                for (const glm::ivec3 d :
                     {glm::ivec3(1, 0, 0), glm::ivec3(-1, 0, 0), glm::ivec3(0, 1, 0),
                      glm::ivec3(0, -1, 0), glm::ivec3(0, 0, 1), glm::ivec3(0, 0, -1)})
                    if (!here[greys.at(i)] && greys.has(i + d) && here[greys.at(i + d)])
                        here[greys.at(i)] = grown = true;
        }
        for (size_t i = 0; i < t.size(); ++i)
            t[i] = t[i] || here[i];
    };
    look(poses.front());
    const glm::dvec3 spacing = spacing_mm(grid);
    const double reach = tool.shape ? tool.shape->bounds().reach_mm() : 0.0;
    for (size_t k = 1; k < poses.size(); ++k) {
        if (poses[k].tool == poses[k - 1].tool)
            continue;
        const int n = std::max(1, int(std::ceil(travel_mm(poses[k - 1], poses[k], reach) /
                                                std::min({spacing.x, spacing.y, spacing.z}))));
        for (int part = 1; part <= n; ++part)
            look(part == n ? poses[k]
                           : pose_between(poses[k - 1], poses[k], double(part) / double(n)));
    }
    return t;
}

// Smooth hills of 8 or so samples with noise, so that what is alike is connected here and there.
Volume hills(Random& random, const Grid& grid, ScalarType type) {
    const double phase = uniform(random, 0.0, 6.0);
    const uint64_t salt = random();
    return make_volume(grid, type, [=](glm::uvec3 i) {
        uint64_t h = (i.x * 73856093u) ^ (i.y * 19349663u) ^ (i.z * 83492791u) ^ salt;
        h = (h ^ h >> 31) * 0x9e3779b97f4a7c15u;
        const double noise = double(h >> 40 & 0xff) / 255.0 - 0.5;
        return std::round(100.0 + 60.0 * std::sin(0.4 * i.x + phase) * std::cos(0.35 * i.y) +
                          15.0 * std::sin(0.5 * i.z) + 12.0 * noise);
    });
}

TEST(AlikeBrush, EqualsItsTwinForAnyPortionsAndThreads) {
    size_t taken = 0, left = 0;
    for (uint64_t seed = 0; seed < 12; ++seed) {
        Random random(4000 + seed);
        const Grid grid =
            make_grid({36, 34, 7}, seed & 1 ? glm::dvec3(0.7, 0.7, 2.5) : glm::dvec3(1.0));
        const Volume greys = hills(random, grid, seed & 2 ? ScalarType::i16 : ScalarType::f32);
        const Volume labels = make_volume(grid, seed & 4 ? ScalarType::u8 : ScalarType::u16,
                                          [](glm::uvec3 i) { return i.x % 7 == 3 ? 2.0 : 0.0; });
        Operation op;
        op.kind = seed % 3 ? OperationKind::draw : OperationKind::erase;
        op.label = 3;
        op.alike = uniform(random, 1.0, 4.0);
        if (seed % 4 == 3)
            op.area = {EditArea::Kind::outside, {2}};
        const Tool tool{seed % 2 ? make_ball(uniform(random, 2.0, 6.0))
                                 : make_cylinder(uniform(random, 2.0, 6.0), 1.2)};
        std::vector<StrokePose> poses;
        for (int i = 0; i < 4; ++i)
            poses.push_back({0.01 * i,
                             {world_point(grid, {uniform(random, 2, 33), uniform(random, 2, 31),
                                                 uniform(random, 1, 5)}),
                              kUpright}});
        const FlatVolume flat(greys);
        const std::vector<bool> t = brute_alike(flat, tool, *op.alike, poses);
        std::optional<Volume> first;
        for (const size_t portion : {1u, 3u, 100u})
            for (const size_t threads : {1u, 2u, 4u}) {
                const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                                threads);
                auto run = StrokeRun::start(labels, tool, op, greys);
                ASSERT_TRUE(run) << run.error().message;
                for (size_t i = 0; i < poses.size(); i += portion) {
                    (*run)->add(std::span(poses).subspan(i, std::min(portion, poses.size() - i)));
                    (*run)->work([] { return false; });
                    (*run)->publish();
                }
                (*run)->lift();
                while (!(*run)->work([] { return false; })) {
                }
                const Volume found = (*run)->publish();
                first = first.value_or(found);
                ASSERT_TRUE(changed_bricks(*first, found).empty())
                    << portion << " poses, " << threads << " threads";
            }
        flat.for_each([&](glm::ivec3 i) {
            const glm::uvec3 at(i);
            const double had = labels.value(at);
            const bool is_taken = t[flat.at(i)] && op.area.has(uint16_t(had));
            const double becomes = op.kind == OperationKind::draw ? 3.0 : 0.0;
            ASSERT_EQ(first->value(at), is_taken ? becomes : had)
                << "seed " << seed << " at " << i.x << " " << i.y << " " << i.z;
            taken += is_taken;
            bool held = false;
            for (size_t k = 0; k < poses.size() && !held; ++k)
                held = holds(tool, grid, poses[k > 0 ? k - 1 : 0], poses[k], i);
            left += held && !t[flat.at(i)];
        });
        if (HasFatalFailure())
            return;
    }
    EXPECT_GT(taken, 1000u);
    EXPECT_GT(left, 1000u);
}

// Two rooms with a wall of one sample between them, of the other values: nothing is drawn behind
// it.
TEST(AlikeBrush, StaysOnItsSideOfAWall) {
    const Grid grid = make_grid({41, 41, 41}, glm::dvec3(1.0));
    const Volume greys =
        make_volume(grid, ScalarType::i16, [](glm::uvec3 i) { return i.x == 20 ? 500.0 : 40.0; });
    const Volume empty = make_volume(grid, ScalarType::u8, [](glm::uvec3) { return 0.0; });
    Operation op;
    op.alike = 3.0;
    const Volume found = *apply_stroke(
        empty, {make_ball(9.0)}, op, std::vector{StrokePose{0.0, {{16, 20, 20}, kUpright}}}, greys);
    FlatVolume(empty).for_each([&](glm::ivec3 i) {
        const bool in_ball = glm::length(glm::dvec3(i) - glm::dvec3(16, 20, 20)) <= 9.0;
        ASSERT_EQ(found.value(glm::uvec3(i)), in_ball && i.x < 20 ? 1.0f : 0.0f);
    });
    // A stroke that goes through the wall into the other room goes on there: its values are alike.
    const Volume through = *apply_stroke(empty, {make_ball(3.0)}, op,
                                         std::vector{StrokePose{0.0, {{12, 20, 20}, kUpright}},
                                                     StrokePose{0.1, {{28, 20, 20}, kUpright}}},
                                         greys);
    EXPECT_EQ(through.value({12, 20, 20}), 1.0f);
    EXPECT_EQ(through.value({20, 20, 20}), 0.0f);
    EXPECT_EQ(through.value({28, 20, 20}), 1.0f);
}

// The range is that of a normal distribution: 1.4826 MAD is its standard deviation. Its relative
// error with 125 values is a tenth; the bound is four of these.
TEST(AlikeBrush, MeasuresDeviationsOfNoise) {
    Random random(5);
    std::normal_distribution<double> noise(40.0, 12.0);
    for (int round = 0; round < 50; ++round) {
        std::vector<double> values(125);
        for (double& v : values)
            v = noise(random);
        const AlikeRange range = alike_range(values, 3.0);
        EXPECT_NEAR((range.high - range.low) / 6.0, 12.0, 0.4 * 12.0);
        EXPECT_NEAR((range.high + range.low) / 2.0, 40.0, 4.0 * 1.2533 * 12.0 / std::sqrt(125.0));
    }
    EXPECT_EQ(alike_range({7.0, 7.0, 7.0}, 3.0).low, 7.0);
    EXPECT_EQ(alike_range({1.0, 3.0}, 1.0).high, 2.0 + 1.4826);
}

TEST(AlikeBrush, OutsideOfTheVolumeOrWithoutAGuideDoesNothing) {
    const Grid grid = make_grid({20, 20, 20}, glm::dvec3(1.0));
    const Volume greys = make_volume(grid, ScalarType::i16, [](glm::uvec3) { return 40.0; });
    const Volume empty = make_volume(grid, ScalarType::u8, [](glm::uvec3) { return 0.0; });
    Operation op;
    op.alike = 3.0;
    const Tool ball{make_ball(4.0)};
    const std::vector<StrokePose> beside{{0.0, {{-3, 10, 10}, kUpright}},
                                         {0.1, {{10, 10, 10}, kUpright}}};
    EXPECT_TRUE(changed_bricks(empty, *apply_stroke(empty, ball, op, beside, greys)).empty());
    const std::vector<StrokePose> leap{{0.0, {{10, 10, 10}, kUpright}},
                                       {0.1, {{1e7, 10, 10}, kUpright}}};
    EXPECT_EQ(apply_stroke(empty, ball, op, leap, greys)->value({19, 10, 10}), 1.0f);
    const Result<Volume> alone = apply_stroke(empty, ball, op, beside);
    ASSERT_FALSE(alone);
    EXPECT_EQ(alone.error().message, "draw: alike needs a guide, a volume of grey values");
}

} // namespace
} // namespace palpate
