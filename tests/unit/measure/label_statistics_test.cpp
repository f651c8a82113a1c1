#include "engine/measure/label_statistics.h"

#include <gtest/gtest.h>

#include <map>

#include "engine/volume/sample.h"
#include "tests/unit/measure/grids.h"

namespace palpate {
namespace {

Volume labels_on(const Grid& grid, ScalarType type = ScalarType::u8) {
    return make_volume(grid, type, [](glm::uvec3 i) {
        return i.x < 5 ? 0.0 : i.y < 9 ? 3.0 : (i.x * i.y + i.z) % 17 == 0 ? 200.0 : 0.0;
    });
}

// Each label by itself, from the definitions.
void expect_as_counted(const std::vector<LabelStatistics>& found, const Volume& labels,
                       const std::function<double(glm::uvec3)>& grey) {
    std::map<uint32_t, std::vector<glm::uvec3>> places;
    for_each_sample(labels.grid(), [&](glm::uvec3 at) {
        if (const auto label = static_cast<uint32_t>(labels.value(at)))
            places[label].push_back(at);
    });
    ASSERT_EQ(found.size(), places.size());
    size_t k = 0;
    for (const auto& [label, all] : places) {
        const LabelStatistics& one = found[k++];
        EXPECT_EQ(one.label, label);
        EXPECT_EQ(one.count, all.size());
        const glm::dmat3 m(labels.grid().world_from_index);
        EXPECT_NEAR(
            one.volume_mm3,
            static_cast<double>(all.size()) * std::abs(glm::dot(m[0], glm::cross(m[1], m[2]))),
            1e-9 * one.volume_mm3);
        glm::dvec3 sum(0.0), least(1e9), most(-1e9);
        double value_sum = 0.0, value_min = INFINITY, value_max = -INFINITY;
        uint64_t with = 0;
        for (const glm::uvec3 at : all) {
            sum += world_point(labels.grid(), glm::dvec3(at));
            least = glm::min(least, glm::dvec3(at));
            most = glm::max(most, glm::dvec3(at));
            const double v = grey(at);
            if (std::isnan(v))
                continue;
            ++with;
            value_sum += v;
            value_min = std::min(value_min, v);
            value_max = std::max(value_max, v);
        }
        EXPECT_LT(glm::distance(one.centroid_mm, sum / static_cast<double>(all.size())), 1e-6);
        EXPECT_EQ(glm::dvec3(one.low), least);
        EXPECT_EQ(glm::dvec3(one.high), most);
        EXPECT_EQ(one.values.count, with);
        EXPECT_EQ(one.values.no_data, all.size() - with);
        if (with == 0) {
            EXPECT_TRUE(std::isnan(one.values.mean));
            continue;
        }
        // Values below 3001 as floats: each is off by at most 1.3e-4.
        EXPECT_NEAR(one.values.mean, value_sum / static_cast<double>(with), 2e-4);
        EXPECT_NEAR(one.values.min, value_min, 2e-4);
        EXPECT_NEAR(one.values.max, value_max, 2e-4);
    }
}

TEST(LabelStatistics, AreThoseOfEachLabelsSamples) {
    std::mt19937 random(1);
    for (int i = 0; i < 10; ++i) {
        const Grid grid = random_grid(random);
        const Volume labels = labels_on(grid), grey = noise_volume(grid);
        expect_as_counted(label_statistics(labels, &grey).value(), labels,
                          [&](glm::uvec3 at) { return double{grey.value(at)}; });
    }
}

TEST(LabelStatistics, ValuesOfAnotherGridAreInterpolated) {
    std::mt19937 random(2);
    for (int i = 0; i < 10; ++i) {
        const Grid grid = random_grid(random);
        Grid other = grid; // shifted, finer, smaller
        other.world_from_index =
            glm::scale(glm::translate(grid.world_from_index, glm::dvec3(3.3, 2.2, 1.1)),
                       glm::dvec3(0.4, 0.5, 0.6));
        const Volume labels = labels_on(grid, ScalarType::u16), grey = noise_volume(other);
        expect_as_counted(label_statistics(labels, &grey).value(), labels, [&](glm::uvec3 at) {
            return trilinear(grey, index_point(other, world_point(grid, glm::dvec3(at))));
        });
    }
}

TEST(LabelStatistics, WithoutGreyValuesAndWithoutLabels) {
    const Grid grid = make_grid({20, 20, 20}, {1, 2, 3});
    const Volume labels = labels_on(grid);
    const auto found = label_statistics(labels, nullptr).value();
    ASSERT_EQ(found.size(), 2u);
    EXPECT_EQ(found[0].label, 3u);
    EXPECT_EQ(found[0].count, 15u * 9u * 20u);
    EXPECT_DOUBLE_EQ(found[0].volume_mm3, 15.0 * 9.0 * 20.0 * 6.0);
    EXPECT_EQ(found[0].values.count, 0u);
    EXPECT_TRUE(std::isnan(found[0].values.mean));
    const Volume empty = make_volume(grid, ScalarType::u8, [](glm::uvec3) { return 0.0; });
    EXPECT_TRUE(label_statistics(empty, nullptr).value().empty());
    std::stop_source stop;
    stop.request_stop();
    EXPECT_FALSE(label_statistics(labels, nullptr, stop.get_token()));
}

} // namespace
} // namespace palpate
