#include "engine/measure/removed.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "engine/measure/label_statistics.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "engine/volume/extent.h"

namespace palpate {
namespace {

// Sample by sample, from the two volumes alone.
RemovedSamples counted(const Volume& before, const Volume& now, double iso, const Volume* labels) {
    RemovedSamples removed;
    const glm::uvec3 size = now.size();
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x) {
                const bool was = before.value({x, y, z}) >= iso, is = now.value({x, y, z}) >= iso;
                if (was && !is)
                    ++removed[uint16_t(labels ? labels->value({x, y, z}) : 0)];
            }
    return removed;
}

// Values, labels, iso and time go back and forth; what is known of bricks is used again.
TEST(Removed, IsWhatTheTwoVolumesDifferBy) {
    std::mt19937_64 random(1);
    const auto pick = [&](int low, int high) {
        return std::uniform_int_distribution<int>(low, high)(random);
    };
    const Grid grid = make_grid({70, 40, 33}, {0.5, 0.5, 2.0});
    for (const ScalarType type : {ScalarType::i16, ScalarType::f32}) {
        std::vector<Volume> states{make_volume(grid, type, [&](glm::uvec3 i) {
            return type == ScalarType::f32 && i.x % 17 == 0
                       ? std::numeric_limits<double>::quiet_NaN()
                       : double(pick(-100, 300));
        })};
        std::vector<Volume> labels{
            make_volume(grid, ScalarType::u8, [](glm::uvec3 i) { return double(i.x / 20); })};
        RemovedCounter counter;
        counter.begin(states[0]);
        size_t at = 0;
        Volume base = states[0];
        double iso = 100.0;
        uint64_t most = 0;
        for (int step = 0; step < 60; ++step) {
            const auto change = [&](Volume volume, double low, double high) {
                VolumeEdit edit(std::move(volume));
                const glm::uvec3 from(pick(0, 60), pick(0, 30), pick(0, 25));
                for (uint32_t z = from.z; z < from.z + 8; ++z)
                    for (uint32_t y = from.y; y < from.y + 8; ++y)
                        for (uint32_t x = from.x; x < from.x + 8; ++x)
                            edit.set({x, y, z}, std::uniform_real_distribution(low, high)(random));
                return edit.commit();
            };
            switch (pick(0, 9)) {
                case 0: // undo, as far as it goes
                    at = size_t(pick(0, int(at)));
                    break;
                case 1: // redo
                    at = size_t(pick(int(at), int(states.size()) - 1));
                    break;
                case 2:
                    iso = pick(-50, 250);
                    break;
                case 3:
                    labels.push_back(change(labels.back(), 0.0, 4.0));
                    break;
                case 4:
                    if (pick(0, 3) == 0) {
                        base = states[at];
                        counter.begin(base);
                    }
                    break;
                default:
                    states.resize(at + 1, states[0]);
                    states.push_back(change(states[at], -100.0, 150.0));
                    ++at;
            }
            const bool with_labels = pick(0, 4) != 0;
            const RemovedSamples found = counter.count(
                states[at], iso, with_labels ? std::optional(labels.back()) : std::nullopt);
            ASSERT_EQ(found, counted(base, states[at], iso, with_labels ? &labels.back() : nullptr))
                << "step " << step;
            for (const auto& [label, samples] : found)
                most = std::max(most, samples);
        }
        EXPECT_GT(most, 100u);
    }
}

// A ball cut out of solid matter, by its exact volume. A sample's cell is counted whole or not at
// all by its middle, so the count is off by at most the cells that the surface passes through:
// those whose middle is within half a cell's diagonal of it.
TEST(Removed, IsTheVolumeOfABall) {
    const double radius_mm = 9.0;
    const glm::dvec3 spacing(0.5, 0.6, 0.8);
    const Grid grid = make_grid({60, 50, 40}, spacing);
    const glm::dvec3 center = world_point(grid, 0.5 * (glm::dvec3(grid.size) - 1.0));
    const Volume before = make_volume(grid, ScalarType::i16, [](glm::uvec3) { return 1000.0; });
    const Volume after = make_volume(grid, ScalarType::i16, [&](glm::uvec3 i) {
        const double mm = glm::distance(world_point(grid, glm::dvec3(i)), center) - radius_mm;
        return 500.0 + 500.0 * std::clamp(mm, -1.0, 1.0); // a smooth wall
    });
    RemovedCounter counter;
    counter.begin(before);
    const double found_mm3 =
        sample_mm3(grid) * double(counter.count(after, 500.0, std::nullopt).at(0));
    const auto ball_mm3 = [](double r) { return 4.0 / 3.0 * std::numbers::pi * r * r * r; };
    const double half_mm = 0.5 * glm::length(spacing);
    EXPECT_GT(found_mm3, ball_mm3(radius_mm - half_mm));
    EXPECT_LT(found_mm3, ball_mm3(radius_mm + half_mm));
}

} // namespace
} // namespace palpate
