#include "engine/edit/operation.h"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include "engine/edit/stroke_run.h"
#include "engine/volume/changes.h"
#include "tests/unit/edit/twin.h"

namespace palpate {
namespace {

const Tool kEverywhere{make_ball(1e4)};

Volume apply(const Volume& before, const Tool& tool, const Operation& op,
             std::vector<StrokePose> poses = {{}}) {
    const Result<Volume> after = apply_stroke(before, tool, op, poses);
    EXPECT_TRUE(after) << after.error().message;
    return *after;
}

Operation label_operation(OperationKind kind, uint16_t label, int neighbours) {
    Operation op;
    op.kind = kind;
    op.label = label;
    op.neighbours = neighbours;
    return op;
}

bool same(const Volume& a, const Volume& b) {
    return changed_bricks(a, b).empty();
}

uint64_t count(const Volume& volume, float label) {
    uint64_t n = 0;
    FlatVolume(volume).for_each([&](glm::ivec3 i) { n += volume.value(glm::uvec3(i)) == label; });
    return n;
}

// Every sample of `label` in a is one in b.
bool within(const Volume& a, const Volume& b, float label) {
    bool holds = true;
    FlatVolume(a).for_each([&](glm::ivec3 i) {
        const glm::uvec3 u(i);
        holds = holds && (a.value(u) != label || b.value(u) == label);
    });
    return holds;
}

class Morphology : public testing::TestWithParam<int> {
 protected:
    Volume labels(uint64_t seed) const {
        Random random(seed);
        return random_labels(random, make_grid({40, 37, 33}, {1, 1, 5}), ScalarType::u8);
    }
    Operation erode(uint16_t label) const {
        return label_operation(OperationKind::erode, label, GetParam());
    }
    Operation dilate(uint16_t label) const {
        return label_operation(OperationKind::dilate, label, GetParam());
    }
    Volume open(const Volume& v) const {
        return apply(apply(v, kEverywhere, erode(1)), kEverywhere, dilate(1));
    }
    // Labels other than `label` become 0.
    static Volume only(const Volume& v, float label) {
        return make_volume(v.grid(), ScalarType::u8,
                           [&](glm::uvec3 i) { return v.value(i) == label ? 1.0 : 0.0; });
    }
};

TEST_P(Morphology, ErosionShrinksAndDilationGrows) {
    const Volume v = labels(1), less = apply(v, kEverywhere, erode(1)),
                 more = apply(v, kEverywhere, dilate(1));
    EXPECT_TRUE(within(less, v, 1) && within(v, more, 1));
    EXPECT_LT(count(less, 1), count(v, 1));
    EXPECT_GT(count(more, 1), count(v, 1));
}

TEST_P(Morphology, ErosionIsDilationOfTheRest) {
    const Volume v = only(labels(2), 1);
    Operation grow_rest = dilate(2);
    const Volume rest = make_volume(v.grid(), ScalarType::u8,
                                    [&](glm::uvec3 i) { return v.value(i) == 1 ? 1.0 : 2.0; });
    const Volume eroded = apply(v, kEverywhere, erode(1));
    const Volume dilated = apply(rest, kEverywhere, grow_rest);
    FlatVolume(v).for_each([&](glm::ivec3 i) {
        ASSERT_EQ(eroded.value(glm::uvec3(i)) == 1, dilated.value(glm::uvec3(i)) == 1);
    });
}

TEST_P(Morphology, OpeningIsIdempotentAndShrinks) {
    const Volume v = only(labels(3), 1), opened = open(v);
    EXPECT_TRUE(within(opened, v, 1));
    EXPECT_FALSE(same(opened, v));
    EXPECT_TRUE(same(open(opened), opened));
}

TEST_P(Morphology, OnePressPeelsOneLayer) {
    const Volume v = only(labels(4), 1);
    const Tool ball{make_ball(30.0)};
    std::vector<StrokePose> rubbing; // to and fro over the same place, for long
    for (int i = 0; i < 50; ++i)
        rubbing.push_back({0.01 * i, {glm::dvec3(20 + i % 5, 18, 60), {1, 0, 0, 0}}});
    const Volume once = apply(v, kEverywhere, erode(1)), rubbed = apply(v, ball, erode(1), rubbing);
    EXPECT_FALSE(same(rubbed, v));
    EXPECT_TRUE(within(once, rubbed, 1)); // nothing beyond the first layer is gone
    EXPECT_FALSE(same(apply(rubbed, ball, erode(1), rubbing), rubbed)); // the next press goes on
}

INSTANTIATE_TEST_SUITE_P(Neighbours, Morphology, testing::Values(6, 18, 26));

// 200 mm in 10 ms at 1000 poses a second, and in one leap.
TEST(Stroke, LeavesNoGapAtAnySpeed) {
    const Grid grid = make_grid({420, 40, 40}, glm::dvec3(0.5));
    const Volume empty = make_volume(grid, ScalarType::u8, [](glm::uvec3) { return 0.0; });
    for (const ShapePtr& shape : {make_ball(2.0), make_box({3, 3, 3}), make_burr(2.5, 4, 0.5)})
        for (const int steps : {1, 10}) {
            std::vector<StrokePose> poses;
            for (int i = 0; i <= steps; ++i)
                poses.push_back(
                    {0.01 * i / steps, {glm::dvec3(4 + 200.0 * i / steps, 10, 10), kUpright}});
            const Volume drawn =
                apply(empty, Tool{shape}, label_operation(OperationKind::draw, 1, 6), poses);
            for (uint32_t x = 8; x <= 408; ++x) // and as wide everywhere as at its middle
                for (uint32_t y = 0; y < 40; ++y)
                    for (uint32_t z = 0; z < 40; ++z)
                        if (std::abs(int(x) - 208) < 195) {
                            ASSERT_EQ(drawn.value({x, y, z}), drawn.value({208, y, z}))
                                << x << " " << y << " " << z;
                        }
            EXPECT_EQ(drawn.value({208, 20, 20}), 1.0f);
        }
}

class Portions : public testing::TestWithParam<OperationKind> {};

TEST_P(Portions, OfPosesSlicesAndThreadsChangeNoByte) {
    Random random(uint64_t(GetParam()) + 1);
    Operation op = random_operation(random, GetParam());
    op.only_values.reset();
    op.area = {};
    op.over.reset();
    const Grid grid = random_grid(random, {70, 60, 40});
    op.smallest_mm3 = 1e3;
    const Volume specks = make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) { // holes or islands
        const bool speck = (i.x * 7 + i.y * 13 + i.z * 29) % 37 < 2;
        return speck == (op.kind == OperationKind::islands) ? double(op.label) : 0.0;
    });
    const Volume before = op.by_region()   ? specks
                          : op.on_labels() ? random_labels(random, grid, ScalarType::u8)
                                           : random_greys(random, grid, ScalarType::i16);
    for (const Tool& tool : {Tool{make_ball(4.0)}, Tool{make_burr(4.0, 3, 1.0), true}}) {
        const std::vector<StrokePose> poses = random_path(random, grid, 30);
        std::optional<Volume> first;
        for (const size_t portion : {1u, 7u, 1000u})
            for (const size_t threads : {1u, 4u})
                for (const bool sliced : {false, true}) {
                    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                                    threads);
                    auto run = StrokeRun::start(before, tool, op);
                    ASSERT_TRUE(run);
                    for (size_t i = 0; i < poses.size(); i += portion) {
                        (*run)->add(
                            std::span(poses).subspan(i, std::min(portion, poses.size() - i)));
                        if (sliced) // a little work and a snapshot now and then
                            (*run)->work([] { return false; });
                        else
                            (*run)->work();
                        if (i % 3 == 0)
                            (*run)->publish();
                    }
                    (*run)->lift();
                    while (!(*run)->work([] { return false; })) {
                    }
                    const Volume after = (*run)->publish();
                    if (!first)
                        first = after;
                    ASSERT_TRUE(same(*first, after))
                        << portion << " poses, " << threads << " threads";
                }
        EXPECT_FALSE(same(*first, before));
    }
}

INSTANTIATE_TEST_SUITE_P(Operations, Portions,
                         testing::Values(OperationKind::draw, OperationKind::erode,
                                         OperationKind::smooth, OperationKind::fill,
                                         OperationKind::islands, OperationKind::mill),
                         operation_name);

TEST(Stroke, TouchesOnlyTheBricksOfItsTool) {
    const Grid grid = make_grid(glm::uvec3(512), glm::dvec3(0.5));
    const Volume before = make_volume(grid, ScalarType::u8, [](glm::uvec3) { return 0.0; });
    const Volume after =
        apply(before, Tool{make_ball(5.0)}, label_operation(OperationKind::draw, 1, 6),
              {{0, {glm::dvec3(64), kUpright}}});
    EXPECT_EQ(changed_bricks(before, after).size(), 8u); // 64 mm is where eight bricks meet
}

TEST(Mill, TakesByTimeDepthAndMaterial) {
    const Grid grid = make_grid(glm::uvec3(33), glm::dvec3(0.5));
    const Volume soft = make_volume(grid, ScalarType::i16, [](glm::uvec3) { return 300.0; });
    Operation mill;
    mill.kind = OperationKind::mill;
    mill.to_value = -1000;
    mill.falloff_mm = 2.0;
    mill.rates = {{0, 4000}, {1000, 1000}}; // 3100 a second at 300
    const Tool ball{make_ball(4.0)};
    const auto after = [&](double seconds) {
        return apply(soft, ball, mill,
                     {{0, {glm::dvec3(8), kUpright}}, {seconds, {glm::dvec3(8), kUpright}}});
    };
    EXPECT_EQ(after(0.1).value({16, 16, 16}), -10.0f);
    EXPECT_EQ(after(0.2).value({16, 16, 16}), -320.0f);
    EXPECT_EQ(after(9.0).value({16, 16, 16}), -1000.0f); // and not beyond
    EXPECT_EQ(after(0.1).value({22, 16, 16}), 114.0f);   // 1 mm deep, of 2: (1 + 0.5) / (2 + 0.5)
    EXPECT_EQ(after(0.1).value({24, 16, 16}), 238.0f);   // at the surface: 0.5 / 2.5
    EXPECT_EQ(after(9.0).value({24, 16, 16}), -350.0f);  // half of the way, and not beyond
    EXPECT_EQ(after(9.0).value({25, 16, 16}), 300.0f);   // a sample outside
    mill.walls = Walls::samples;
    EXPECT_EQ(after(0.1).value({16, 16, 16}), -10.0f);
    EXPECT_EQ(after(0.1).value({22, 16, 16}), 145.0f); // 1 mm deep: half as fast
    EXPECT_EQ(after(0.1).value({24, 16, 16}), 300.0f); // at the surface: not at all
    mill.to_value = 500;
    EXPECT_EQ(after(0.02).value({16, 16, 16}), 362.0f); // towards a higher value: adds
}

// At 1000 poses a second each takes less than one unit: what is kept is time, not rounded values.
TEST(Mill, SlowRatesAreNotLostToRounding) {
    const Grid grid = make_grid(glm::uvec3(16), glm::dvec3(1));
    const Volume v = make_volume(grid, ScalarType::u8, [](glm::uvec3) { return 200.0; });
    Operation mill;
    mill.kind = OperationKind::mill;
    mill.to_value = 0;
    mill.rates = {{0, 100}}; // 0.1 a pose
    std::vector<StrokePose> poses;
    for (int i = 0; i <= 1000; ++i)
        poses.push_back({i / 1000.0, {glm::dvec3(8), kUpright}});
    EXPECT_EQ(apply(v, Tool{make_ball(2.0)}, mill, poses).value({8, 8, 8}), 100.0f);
}

// A leap as far as a pose may be, at 1 mm/s, has 2e8 parts; the volume meets the first few of them.
// The same way ended behind the volume has parts of the same length at the same places: 0.5 mm is
// exact, and no sample lies where rounding decides (y and the radius are no multiples of it).
TEST(Mill, ALeapCostsWhatItMeets) {
    const Grid grid = make_grid({70, 40, 40}, glm::dvec3(1));
    const Volume v = make_volume(grid, ScalarType::i16, [](glm::uvec3 i) { return 900.0 + i.x; });
    Operation mill;
    mill.kind = OperationKind::mill;
    mill.to_value = 0;
    mill.rates = {{0, 20}};
    const Tool ball{make_ball(4.1)};
    const StrokePose start{0, {{-3, 16.13, 20}, kUpright}};
    const auto after = [&](double mm) {
        return apply(v, ball, mill,
                     {start, {mm, {start.tool.position_mm + glm::dvec3(mm, 0, 0), kUpright}}});
    };
    const Volume leap = after(1e8 - 64.0);
    EXPECT_TRUE(same(leap, after(128.0)));
    EXPECT_LT(leap.value({35, 16, 20}), 935.0f - 20.0f * 7.0f); // 8.2 mm at 1 mm/s
    // A leap past the volume meets none of it, though its box does.
    const Volume past =
        apply(v, ball, mill, {{0, {{-1e8, 0, 60}, kUpright}}, {1, {{1e8, 1e8, -60}, kUpright}}});
    EXPECT_TRUE(same(past, v));
}

// Asked to stop within the one brick of a sweep: what is under way ends at the row it is in.
TEST(Stroke, StopsWithinASlice) {
    struct Counting : Shape { // every sample is one look: nothing can be leapt over
        double signed_mm(glm::dvec3) const override {
            if (++*looks == 1000)
                stop->request_stop();
            return 0.0;
        }
        BoxMm bounds() const override { return {glm::dvec3(-100), glm::dvec3(100)}; }
        std::atomic<int>* looks;
        std::stop_source* stop;
    };
    for (const OperationKind kind : {OperationKind::cut, OperationKind::mill}) {
        std::atomic<int> looks = 0;
        std::stop_source stop;
        const auto shape = std::make_shared<Counting>();
        shape->looks = &looks;
        shape->stop = &stop;
        Operation op;
        op.kind = kind;
        op.rates = {{0, 1}};
        const Volume before = make_volume(make_grid(glm::uvec3(32), glm::dvec3(1)), ScalarType::i16,
                                          [](glm::uvec3) { return 100.0; });
        auto run = StrokeRun::start(before, {shape}, op);
        ASSERT_TRUE(run) << run.error().message;
        (*run)->add(std::vector<StrokePose>{{0, {glm::dvec3(0), kUpright}},
                                            {1, {glm::dvec3(1), kUpright}}});
        (*run)->lift();
        EXPECT_FALSE((*run)->work([] { return true; }, stop.get_token()));
        // One brick is one thread's work; a row has 32 samples. Each has six looks for the slope,
        // and one every 1/16 mm of the tip's 1.74 mm, which is 28 and those at both ends.
        EXPECT_LE(looks, 1000 + 32 * (6 + 28 + 2));
    }
}

TEST(Operation, IsSettledByTheLowestValueOfTheVolume) {
    const Grid grid = make_grid(glm::uvec3(8), glm::dvec3(1));
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto lowest_of = [&](ScalarType type, auto value) {
        Operation op;
        op.kind = OperationKind::cut;
        const Volume v = make_volume(grid, type, value);
        EXPECT_TRUE(check(settled(op, v), v, nullptr));
        return settled(op, v).to_value;
    };
    EXPECT_EQ(lowest_of(ScalarType::u16, [](glm::uvec3 i) { return 40.0 + i.x; }), 40.0);
    EXPECT_EQ(lowest_of(ScalarType::i16, [](glm::uvec3 i) { return i.x - 1024.0; }), -1024.0);
    EXPECT_EQ(lowest_of(ScalarType::f32, [&](glm::uvec3 i) { return i.x < 4 ? nan : i.x; }), 4.0);
    EXPECT_EQ(lowest_of(ScalarType::f32, [&](glm::uvec3) { return nan; }), 0.0);
    Operation said;
    said.kind = OperationKind::mill;
    said.to_value = 7;
    const Volume v = make_volume(grid, ScalarType::u8, [](glm::uvec3) { return 5.0; });
    EXPECT_EQ(settled(said, v), said);
    EXPECT_EQ(settled(Operation{}, v), Operation{}); // on labels
}

TEST(Operation, RefusesValuesThatNoFileHolds) {
    const Volume v = make_volume(make_grid(glm::uvec3(8), glm::dvec3(1)), ScalarType::u8,
                                 [](glm::uvec3) { return 5.0; });
    const auto why = [&](const auto& change) {
        Operation op;
        op.kind = OperationKind::mill;
        op.to_value = 0;
        op.rates = {{0, 1}};
        EXPECT_TRUE(check(op, v, nullptr));
        change(op);
        const auto run = StrokeRun::start(v, Tool{make_ball(1.0)}, op);
        return run ? "fits" : run.error().message;
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    using enum OperationKind;
    EXPECT_EQ(why([](Operation& op) { op.rates.clear(); }),
              "mill: expected at least one rate, found none");
    EXPECT_THAT(why([](Operation& op) {
                    op.rates = {{2, 1}, {2, 3}};
                }),
                testing::HasSubstr("whose values rise, found 2 after 2"));
    EXPECT_THAT(why([](Operation& op) {
                    op.rates = {{2, -1}};
                }),
                testing::HasSubstr("at least 0 per second, found -1 at 2"));
    EXPECT_THAT(why([&](Operation& op) { op.to_value = nan; }), testing::HasSubstr("to_value"));
    for (const double beyond : {-1.0, 256.0})
        EXPECT_EQ(why([&](Operation& op) { op.to_value = beyond; }),
                  fmt::format("mill: expected a to_value within 0 .. 255, which the volume's type "
                              "u8 holds, found {}",
                              beyond));
    EXPECT_THAT(why([](Operation& op) { op.falloff_mm = -1; }), testing::HasSubstr("falloff"));
    EXPECT_THAT(why([&](Operation& op) {
                    op.only_values = {3, nan};
                }),
                testing::HasSubstr("only_values that rise"));
    for (const OperationKind kind : {erode, dilate, fill, islands})
        EXPECT_THAT(why([&](Operation& op) {
                        op.kind = kind;
                        op.neighbours = 8;
                    }),
                    testing::HasSubstr("expected 6, 18 or 26 neighbours, found 8"));
    EXPECT_EQ(why([](Operation& op) {
                  op.kind = draw;
                  op.label = 0;
              }),
              "draw: expected a label from 1 to 65535, found 0");
}

TEST(Operation, RefusesWhatItCannotDo) {
    Random random(1);
    const Grid grid = make_grid(glm::uvec3(8), glm::dvec3(1));
    const Volume greys = random_greys(random, grid, ScalarType::i16);
    const Volume labels = random_labels(random, grid, ScalarType::u8);
    Operation op = label_operation(OperationKind::draw, 1, 6);
    const auto why = [&](const Volume& v, const Volume* guide = nullptr) {
        const Result<void> fits = check(op, v, guide);
        return fits ? "fits" : fits.error().message;
    };
    EXPECT_EQ(why(greys), "draw: expected labels stored as u8 or u16, found i16");
    EXPECT_EQ(why(labels), "fits");
    op.only_values = {0, 1};
    EXPECT_EQ(why(labels), "draw: only_values needs a guide, a volume of grey values");
    EXPECT_EQ(why(labels, &greys), "fits");
    const Volume small = random_greys(random, make_grid({8, 8, 7}, glm::dvec3(1)), ScalarType::u8);
    EXPECT_EQ(why(labels, &small), "draw: expected a guide of 8 x 8 x 8 samples, found 8 x 8 x 7");
    // Elsewhere in the patient, by the spacing, the origin or the direction. One sixteenth of a
    // millimetre is allowed; what 32-bit floats make of these numbers is far less.
    const auto guide_at = [&](const Grid& where) { return with_grid(greys, where); };
    const auto moved = [&](double mm) { return make_grid(glm::uvec3(8), {1, 1, 1}, {0, 0, mm}); };
    const Volume far = guide_at(moved(0.07)), near = guide_at(moved(0.06));
    const Volume thick = guide_at(make_grid(glm::uvec3(8), {1, 1, 2}));
    Grid turned = grid;
    turned.world_from_index[0] = {0, 1, 0, 0};
    turned.world_from_index[1] = {1, 0, 0, 0};
    Grid rounded = make_grid(glm::uvec3(8), {1.0 + 1e-7, 1, 1}, {1e-5, 0, 0});
    const Volume across = guide_at(turned), as_floats = guide_at(rounded);
    EXPECT_EQ(why(labels, &near), "fits");
    EXPECT_EQ(why(labels, &as_floats), "fits");
    EXPECT_THAT(why(labels, &far), testing::HasSubstr("0.07 mm away"));
    EXPECT_THAT(why(labels, &thick),
                testing::HasSubstr("within 0.0625 mm, found sample (0, 0, 7) 7 mm away (spacing 1 "
                                   "x 1 x 1 and 1 x 1 x 2 mm"));
    EXPECT_THAT(why(labels, &across), testing::HasSubstr("9.899 mm away")); // 7 * sqrt(2)
    op.only_values.reset();
    op.label = 65535; // the map of u8 grows with it
    EXPECT_EQ(why(labels), "fits");
    op = label_operation(OperationKind::smooth, 1, 6);
    op.radius_mm = 100;
    EXPECT_THAT(why(labels), testing::HasSubstr("at most 64 samples"));
}

} // namespace
} // namespace palpate
