#include "engine/segment/label_logic.h"

#include <gtest/gtest.h>

#include <map>

#include "engine/segment/label_median.h"
#include "tests/unit/shape/random_labels.h"

namespace palpate {
namespace {

const glm::dvec3 kLogicSpacings[] = {{1.0, 1.0, 1.0}, {0.5, 0.8, 2.0}};

Volume as_u16(const Volume& labels, double factor) {
    return make_volume(labels.grid(), ScalarType::u16,
                       [&](glm::uvec3 i) { return factor * double(labels.value(i)); });
}

// The label is a set of samples; the set that it becomes is that of the operation, less what is
// locked.
TEST(LabelLogic, IsThatOfSets) {
    uint64_t seed = 3;
    for (const glm::dvec3 spacing : kLogicSpacings)
        for (const double factor : {1.0, 300.0})
            for (const bool in_map : {true, false}) {
                const Grid grid = make_grid({40, 7, 5}, spacing);
                const Volume drawn = random_labels(grid, 5, 0.6, seed++),
                             other = random_labels(grid, 5, 0.6, seed++);
                const Volume map = factor == 1.0 ? drawn : as_u16(drawn, factor);
                const Volume second = in_map ? map : factor == 1 ? other : as_u16(other, factor);
                const auto label = uint16_t(factor), of = uint16_t(2 * factor);
                const std::array locked{uint16_t(3 * factor)};
                const std::map<LabelLogic, bool (*)(bool, bool)> sets{
                    {LabelLogic::copy, [](bool, bool b) { return b; }},
                    {LabelLogic::add, [](bool a, bool b) { return a || b; }},
                    {LabelLogic::subtract, [](bool a, bool b) { return a && !b; }},
                    {LabelLogic::intersect, [](bool a, bool b) { return a && b; }}};
                for (const auto& [logic, is_in] : sets) {
                    const Result<Volume> made = label_logic(map,
                                                            {.logic = logic,
                                                             .label = label,
                                                             .of = of,
                                                             .other = in_map ? nullptr : &second,
                                                             .locked = locked},
                                                            {});
                    ASSERT_TRUE(made) << made.error().message;
                    EXPECT_EQ(made->type(), map.type());
                    for (size_t n = 0; n < sample_count(grid); ++n) {
                        const glm::uvec3 i = index_of(grid.size, n);
                        const float was = map.value(i);
                        const bool in = is_in(was == label, second.value(i) == of);
                        const float expected = was == locked[0] ? was
                                               : in             ? float(label)
                                               : was == label   ? 0.0f
                                                                : was;
                        ASSERT_EQ(made->value(i), expected) << n;
                    }
                }
            }
}

TEST(LabelLogic, InvertsOverTheBackgroundAlone) {
    const Volume map = random_labels(make_grid({40, 7, 5}, {1, 1, 2}), 4, 0.6, 9);
    const Result<Volume> made = label_logic(map, {.logic = LabelLogic::invert, .label = 2}, {});
    for (size_t n = 0; n < sample_count(map.grid()); ++n) {
        const glm::uvec3 i = index_of(map.size(), n);
        const float was = map.value(i);
        EXPECT_EQ(made->value(i), was == 0.0f ? 2.0f : was == 2.0f ? 0.0f : was);
    }
    EXPECT_EQ(samples_of(*label_logic(*made, {.logic = LabelLogic::invert, .label = 2}, {})),
              samples_of(map));
}

TEST(LabelLogic, ALabelThatTheTypeDoesNotHoldWidensIt) {
    const Volume map = random_labels(make_grid({9, 7, 5}, {1, 1, 2}), 3, 0.6, 9);
    const Result<Volume> made =
        label_logic(map, {.logic = LabelLogic::copy, .label = 700, .of = 2}, {});
    EXPECT_EQ(made->type(), ScalarType::u16);
    for (size_t n = 0; n < sample_count(map.grid()); ++n) {
        const glm::uvec3 i = index_of(map.size(), n);
        EXPECT_EQ(made->value(i), map.value(i) == 2.0f ? 700.0f : map.value(i));
    }
    EXPECT_FALSE(label_logic(map, {.label = 0}, {}));
    const std::array locked{uint16_t{1}};
    EXPECT_FALSE(label_logic(map, {.label = 1, .locked = locked}, {}));
    const Volume small = random_labels(make_grid({9, 7, 4}, {1, 1, 2}), 3, 0.6, 9);
    EXPECT_FALSE(label_logic(map, {.label = 1, .other = &small}, {}));
}

TEST(LabelMedian, IsTheMostFrequentLabelOfTheBall) {
    uint64_t seed = 21;
    for (const glm::dvec3 spacing : kLogicSpacings)
        for (const double radius : {1.0, 2.5})
            for (const bool wide : {false, true}) {
                const Volume drawn = random_labels(make_grid({36, 8, 6}, spacing), 4, 0.8, seed++);
                const Volume map = wide ? as_u16(drawn, 1000.0) : drawn;
                const float locked = wide ? 3000.0f : 3.0f;
                const Result<BrickMaker> maker =
                    label_median_bricks(map, {radius, {uint16_t(locked)}});
                ASSERT_TRUE(maker) << maker.error().message;
                const Result<Volume> made = make_bricks(*maker, {});
                EXPECT_EQ(made->type(), map.type());
                const glm::ivec3 last = glm::ivec3(map.size()) - 1,
                                 reach(glm::ceil(radius / spacing));
                for (size_t n = 0; n < sample_count(map.grid()); ++n) {
                    const glm::ivec3 p(index_of(map.size(), n));
                    const float own = map.value(glm::uvec3(p));
                    std::map<float, int> counts;
                    for (int z = -reach.z; z <= reach.z; ++z)
                        for (int y = -reach.y; y <= reach.y; ++y)
                            for (int x = -reach.x; x <= reach.x; ++x)
                                if (glm::length(glm::dvec3(x, y, z) * spacing) <= radius + 1e-9)
                                    ++counts[map.value(glm::uvec3(
                                        glm::clamp(p + glm::ivec3(x, y, z), glm::ivec3(0), last)))];
                    counts.erase(locked);
                    float best = own;
                    for (const auto& [label, count] : counts)
                        if (count > counts[best])
                            best = label;
                    ASSERT_EQ(made->value(glm::uvec3(p)), own == locked ? own : best) << n;
                }
            }
    const Volume map = random_labels(make_grid({9, 8, 6}, {1, 1, 2}), 4, 0.8, 1);
    EXPECT_FALSE(label_median_bricks(map, {0.0, {}}));
    EXPECT_FALSE(label_median_bricks(map, {8.5, {}}));
}

} // namespace
} // namespace palpate
