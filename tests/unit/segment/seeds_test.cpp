#include "engine/segment/seeds.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <random>

#include "engine/volume/builder.h"

namespace palpate {
namespace {

using testing::HasSubstr;

Grid oblique_grid() {
    Grid grid = make_grid({20, 18, 9}, {0.5, 0.7, 3.0}, {-4, 10, 2});
    const double c = std::cos(0.4), s = std::sin(0.4);
    glm::dmat4 turn(1.0);
    turn[0][0] = c, turn[0][2] = s, turn[2][0] = -s, turn[2][2] = c;
    grid.world_from_index = turn * grid.world_from_index;
    grid.world_from_index[1] += 0.3 * grid.world_from_index[0]; // sheared
    return grid;
}

Volume ramp(const Grid& grid) {
    return make_volume(grid, ScalarType::i16, [](glm::uvec3 i) { return double(i.x) - 5.0; });
}

TEST(Seeds, MapOfBallsEqualsTheDefinition) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    for (const Grid& grid : {make_grid({20, 18, 9}, {0.5, 0.5, 3.0}), oblique_grid(),
                             make_grid({40, 1, 1}, {1, 2, 3})}) {
        const Volume volume = ramp(grid);
        std::vector<SeedBall> balls;
        for (int n = 0; n < 12; ++n) {
            const glm::dvec3 at = glm::dvec3(share(random), share(random), share(random)) *
                                  glm::dvec3(grid.size - 1u);
            balls.push_back({uint16_t(1 + n % 3), world_point(grid, at), n % 4 * share(random)});
        }
        const Result<Volume> map = seed_map(volume, balls);
        ASSERT_TRUE(map) << map.error().message;
        EXPECT_EQ(map->type(), ScalarType::u8);
        // Every sample against every ball, the last one first.
        for (uint32_t z = 0; z < grid.size.z; ++z)
            for (uint32_t y = 0; y < grid.size.y; ++y)
                for (uint32_t x = 0; x < grid.size.x; ++x) {
                    const glm::dvec3 mm = world_point(grid, {x, y, z});
                    int expected = 0;
                    for (const SeedBall& ball : balls) {
                        const glm::dvec3 nearest = glm::round(index_point(grid, ball.center_mm));
                        if (glm::length(mm - ball.center_mm) <= ball.radius_mm)
                            expected = ball.label;
                        else if (glm::dvec3(x, y, z) == nearest) {
                            bool any = false; // is another sample within it?
                            for (uint32_t w = 0; w < grid.size.z; ++w)
                                for (uint32_t v = 0; v < grid.size.y; ++v)
                                    for (uint32_t u = 0; u < grid.size.x; ++u)
                                        any |= glm::length(world_point(grid, {u, v, w}) -
                                                           ball.center_mm) <= ball.radius_mm;
                            if (!any)
                                expected = ball.label;
                        }
                    }
                    EXPECT_EQ(map->value({x, y, z}), float(expected));
                }
    }
}

TEST(Seeds, FileIsReadAsItIsWritten) {
    const SeedFile file{{{1, {1, 2.5, -3}, 8.0}, {300, {0.1, 0, 1e-3}, 0.0}}, 300, oblique_grid()};
    const Result<SeedFile> read = parse_seeds(seeds_text(file), "f.json");
    ASSERT_TRUE(read) << read.error().message;
    ASSERT_EQ(read->balls.size(), 2u);
    for (size_t i = 0; i < 2; ++i) {
        EXPECT_EQ(read->balls[i].label, file.balls[i].label);
        EXPECT_EQ(read->balls[i].center_mm, file.balls[i].center_mm);
        EXPECT_EQ(read->balls[i].radius_mm, file.balls[i].radius_mm);
    }
    EXPECT_EQ(read->background, 300);
    EXPECT_EQ(read->grid, file.grid);
}

TEST(Seeds, BadOnesAreOneSentenceEach) {
    const Volume volume = ramp(make_grid({20, 18, 9}, {0.5, 0.5, 3.0}));
    const auto parse = [](const char* text) {
        const Result<SeedFile> read = parse_seeds(text, "f.json");
        return read ? "" : read.error().message;
    };
    EXPECT_THAT(parse("{\"seeds\": 1, \"units\": \"mm\"}"), HasSubstr("found none"));
    EXPECT_THAT(parse("{\"seeds\": 2, \"units\": \"mm\"}"), HasSubstr("f.json:1: seeds"));
    EXPECT_THAT(parse("{\"seeds\": 1, \"units\": \"mm\", \"points\": [{\"label\": 0, \"at_mm\": "
                      "[1, 2, 3]}]}"),
                HasSubstr("points[0].label"));
    EXPECT_THAT(parse("{\"seeds\": 1, \"units\": \"mm\", \"background\": 2, \"points\": "
                      "[{\"label\": 1, \"at_mm\": [1, 2, 3]}]}"),
                HasSubstr("no seed has it"));
    EXPECT_THAT(parse("{\"seeds\": 1, \"units\": \"mm\", \"balls\": [{\"label\": 1, \"center_mm\": "
                      "[1, 2, 3], \"radius_mm\": -1}]}"),
                HasSubstr("radius_mm"));

    const SeedBall outside[] = {{1, {-5, 0, 0}, 1.0}};
    EXPECT_THAT(seed_map(volume, outside).error().message, HasSubstr("outside the volume"));
    const SeedFile other{
        {{1, {1, 1, 1}, 0}}, 0, make_grid({20, 18, 9}, {0.5, 0.5, 3.0}, {9, 0, 0})};
    EXPECT_THAT(seed_map(volume, other, "f.json").error().message,
                HasSubstr("f.json: made for a volume of 20 x 18 x 9"));

    const Volume holed = make_volume(volume.grid(), ScalarType::f32, [](glm::uvec3 i) {
        return i.x < 10 ? std::numeric_limits<double>::quiet_NaN() : 1.0;
    });
    const SeedBall on_nothing[] = {{1, {2, 2, 6}, 1.0}};
    EXPECT_THAT(seed_map(holed, on_nothing).error().message, HasSubstr("has no data"));
    const SeedBall half[] = {{1, {4.75, 4, 6}, 1.0}};
    const Result<Volume> kept = seed_map(holed, half);
    ASSERT_TRUE(kept);
    EXPECT_EQ(kept->value({10, 8, 2}), 1.0f);
    EXPECT_EQ(kept->value({9, 8, 2}), 0.0f);
}

TEST(Seeds, LabelMapsAreChecked) {
    const Grid grid = make_grid({40, 18, 9}, {0.5, 0.5, 3.0});
    const Volume holed = make_volume(grid, ScalarType::f32, [](glm::uvec3 i) {
        return i.x < 10 ? std::numeric_limits<double>::quiet_NaN() : 1.0;
    });
    const auto map = [](const Grid& on, uint32_t first, uint32_t last) {
        return make_volume(on, ScalarType::u8, [=](glm::uvec3 i) {
            return i.x >= first && i.x <= last && i.y == 3 ? 2.0 : 0.0;
        });
    };
    const auto why = [&](const Volume& seeds) {
        const Result<Volume> checked = checked_seeds(holed, seeds, "s.nii");
        return checked ? "" : checked.error().message;
    };
    EXPECT_THAT(why(map(make_grid({40, 18, 8}, {0.5, 0.5, 3.0}), 1, 30)), HasSubstr("40 x 18 x 8"));
    EXPECT_THAT(why(map(make_grid({40, 18, 9}, {0.5, 0.5, 2.0}), 1, 30)), HasSubstr("s.nii"));
    EXPECT_THAT(why(map(grid, 50, 50)), HasSubstr("a label map of zeros"));
    EXPECT_THAT(why(map(grid, 2, 9)), HasSubstr("has no data"));
    EXPECT_THAT(why(holed), HasSubstr("found f32"));
    const Result<Volume> kept = checked_seeds(holed, map(grid, 8, 12), "s.nii");
    ASSERT_TRUE(kept);
    const std::vector<LabelCount> counts = label_counts(*kept);
    ASSERT_EQ(counts.size(), 1u);
    EXPECT_EQ(counts[0].label, 2);
    EXPECT_EQ(counts[0].count, 3u * 9); // x 10 .. 12
}

} // namespace
} // namespace palpate
