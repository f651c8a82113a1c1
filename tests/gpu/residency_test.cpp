#include "engine/render/residency.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "engine/volume/builder.h"

namespace palpate {
namespace {

size_t index_of(glm::uvec3 p, glm::uvec3 count) {
    return p.x + count.x * (p.y + size_t{count.y} * p.z);
}

TEST(Residency, PartsCoverWhatIsNeededOnceAndFit) {
    const glm::uvec3 count(9, 7, 5);
    std::mt19937 random(3);
    for (const double share : {0.05, 0.4, 1.0}) {
        BrickMask needed(9 * 7 * 5);
        std::bernoulli_distribution is_needed(share);
        for (uint8_t& brick : needed)
            brick = is_needed(random);
        const Viewpoint view{{-40.0, 100.0, 500.0}, {}, false};
        const Result<std::vector<Part>> parts = plan_parts(count, needed, 60, 2.0, {&view, 1});
        ASSERT_TRUE(parts) << parts.error().message;
        std::vector<int> covered(needed.size());
        for (const Part& part : *parts) {
            EXPECT_LE(part.bricks.size(), 60u);
            EXPECT_EQ(part.eyes, 1u);
            for (uint32_t z = part.low.z; z < part.high.z; ++z)
                for (uint32_t y = part.low.y; y < part.high.y; ++y)
                    for (uint32_t x = part.low.x; x < part.high.x; ++x)
                        ++covered[index_of({x, y, z}, count)];
            // Every needed brick in the box and next to it is there.
            for (uint32_t z = 0; z < count.z; ++z)
                for (uint32_t y = 0; y < count.y; ++y)
                    for (uint32_t x = 0; x < count.x; ++x) {
                        const glm::ivec3 p(x, y, z);
                        const bool near =
                            glm::all(glm::greaterThanEqual(p + 1, glm::ivec3(part.low))) &&
                            glm::all(glm::lessThanEqual(p, glm::ivec3(part.high)));
                        const bool listed = std::count(part.bricks.begin(), part.bricks.end(),
                                                       glm::uvec3(x, y, z)) == 1;
                        ASSERT_EQ(listed, near && needed[index_of({x, y, z}, count)]);
                    }
        }
        for (size_t i = 0; i < needed.size(); ++i) {
            ASSERT_LE(covered[i], 1);
            ASSERT_GE(covered[i], needed[i]);
        }
    }
}

// Along any ray, the parts come in the order in which they are marched.
TEST(Residency, PartsComeFrontToBack) {
    const glm::uvec3 count(8, 8, 8);
    const BrickMask needed(512, 1);
    std::mt19937 random(5);
    std::uniform_real_distribution<double> place(-300.0, 500.0), unit(-1.0, 1.0);
    for (int i = 0; i < 40; ++i) {
        Viewpoint view{{place(random), place(random), place(random)},
                       {unit(random), unit(random), unit(random)},
                       i % 2 == 1};
        if (i == 0)
            view.eye = {128.0, 100.0, 60.0}; // inside
        const Result<std::vector<Part>> parts = plan_parts(count, needed, 130, 2.0, {&view, 1});
        ASSERT_TRUE(parts) << parts.error().message;
        ASSERT_GT(parts->size(), 4u);
        for (int ray = 0; ray < 50; ++ray) {
            const glm::dvec3 from =
                view.parallel ? glm::dvec3(place(random), place(random), place(random)) : view.eye;
            const glm::dvec3 along = view.parallel
                                         ? view.direction
                                         : glm::dvec3(unit(random), unit(random), unit(random));
            size_t newest = 0;
            for (double t = view.parallel ? -900.0 : 0.0; t < 900.0; t += 0.7) {
                const glm::dvec3 p = from + t * along;
                for (size_t part = 0; part < parts->size(); ++part) {
                    const Part& box = (*parts)[part];
                    if (glm::all(glm::greaterThan(p, glm::dvec3(box.low * kBrickSide))) &&
                        glm::all(glm::lessThan(p, glm::dvec3(box.high * kBrickSide)))) {
                        ASSERT_GE(part, newest);
                        newest = part;
                    }
                }
            }
        }
    }
}

TEST(Residency, OnePartServesBothEyesAndSeveralServeEachInTurn) {
    const glm::uvec3 count(4, 4, 4);
    const BrickMask needed(64, 1);
    const std::array<Viewpoint, 2> eyes{Viewpoint{{60, -200, 64}}, Viewpoint{{68, -200, 64}}};
    const Result<std::vector<Part>> one = plan_parts(count, needed, 64, 2.0, eyes);
    ASSERT_TRUE(one && one->size() == 1);
    EXPECT_EQ(one->front().eyes, 3u);
    const Result<std::vector<Part>> several = plan_parts(count, needed, 40, 2.0, eyes);
    ASSERT_TRUE(several);
    std::map<uint32_t, size_t> parts;
    for (const Part& part : *several)
        ++parts[part.eyes];
    EXPECT_EQ(parts.size(), 2u);
    EXPECT_EQ(parts[1], parts[2]);
}

TEST(Residency, TooLittleRoomForOneBrickAndItsNeighboursIsRefused) {
    const glm::uvec3 count(4, 4, 4);
    const Viewpoint view{{0, 0, -500}};
    const auto parts = plan_parts(count, BrickMask(64, 1), 20, 2.0, {&view, 1});
    ASSERT_FALSE(parts);
    EXPECT_NE(parts.error().message.find("expected room for"), std::string::npos);
}

TEST(Residency, NothingNeededIsOneEmptyPart) {
    const Viewpoint view{{0, 0, -500}};
    const auto parts = plan_parts({4, 4, 4}, BrickMask(64, 0), 20, 2.0, {&view, 1});
    ASSERT_TRUE(parts && parts->size() == 1);
    EXPECT_TRUE(parts->front().bricks.empty());
}

TEST(Residency, NeededIsWhatLiesInReachOfAnOccupiedCell) {
    // 2 x 1 x 1 bricks, cells of 8: cell 3 is the last of the first brick. Distances as CellMap has
    // them for cell 3 occupied.
    const glm::uvec3 cells(8, 4, 4);
    std::vector<uint8_t> distances(128);
    const auto near = [&](uint32_t reach) {
        return std::pair(is_near_occupied({0, 0, 0}, distances, cells, 8, reach),
                         is_near_occupied({1, 0, 0}, distances, cells, 8, reach));
    };
    for (uint32_t z = 0; z < 4; ++z)
        for (uint32_t y = 0; y < 4; ++y)
            for (uint32_t x = 0; x < 8; ++x)
                distances[x + 8 * (y + 4 * z)] = static_cast<uint8_t>(
                    std::max({x > 3 ? x - 3 : 3 - x, y > 1 ? y - 1 : 1 - y, z}));
    EXPECT_EQ(near(0), std::pair(true, true)); // it shares a layer of samples with the second
    for (uint32_t i = 0; i < 128; ++i)         // occupied at 0 instead
        distances[i] = static_cast<uint8_t>(std::max({i % 8, i / 8 % 4, i / 32}));
    EXPECT_EQ(near(1), std::pair(true, false));
    EXPECT_EQ(near(2), std::pair(true, false));
    EXPECT_EQ(near(3), std::pair(true, true));
    for (uint32_t i = 0; i < 128; ++i) // and in the second brick's middle
        distances[i] =
            static_cast<uint8_t>(std::max({i % 8 > 6 ? i % 8 - 6 : 6 - i % 8, i / 8 % 4, i / 32}));
    EXPECT_EQ(near(2), std::pair(false, true));
    EXPECT_EQ(near(3), std::pair(true, true));
}

TEST(Residency, AConstantBrickVariesWhereItMeetsAnotherValue) {
    const Volume volume = make_volume(make_grid({96, 32, 32}, {1, 1, 1}), ScalarType::u8,
                                      [](glm::uvec3 i) { return i.x < 64 ? 3.0 : 4.0; });
    EXPECT_FALSE(varies(volume, {0, 0, 0}));
    EXPECT_TRUE(varies(volume, {1, 0, 0}));
    EXPECT_FALSE(varies(volume, {2, 0, 0}));
}

} // namespace
} // namespace palpate
