#include "engine/session/starter.h"

#include <gmock/gmock.h>

#include <glm/gtc/matrix_transform.hpp>

#include "engine/edit/stroke.h"
#include "engine/volume/builder.h"
#include "haptics/device/hand_path.h"

namespace palpate {
namespace {

using ::testing::HasSubstr;

// Values are minus the distance from `middle` in mm: the surface at -r is a sphere of radius r.
Volume distances(const Grid& grid, glm::dvec3 middle) {
    return make_volume(grid, ScalarType::f32, [=](glm::uvec3 i) {
        return -glm::distance(world_point(grid, glm::dvec3(i)), middle);
    });
}

// A distance's second derivative across the line to the middle is 1 / r, along it 0. So the
// trilinear interpolant on the line is off by at most h^2 / (8 r) for each axis across, and by as
// much more over the half sample beside the middle; the slope along the line is 1.
TEST(Starter, LandsOnASphereFromTheFront) {
    const Grid grid = make_grid({81, 161, 41}, {1.0, 0.5, 2.0}, {-40, -40, -40});
    const Result<Landing> found = find_landing(distances(grid, glm::dvec3(0.0)), -25.0);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_EQ(found->into, glm::dvec3(0, 1, 0));
    EXPECT_EQ(found->at_mm.x, 0.0);
    EXPECT_NEAR(found->at_mm.z, 0.0, 1e-12);
    EXPECT_NEAR(found->at_mm.y, -25.0, (1.0 * 1.0 + 2.0 * 2.0) / (8.0 * 24.0));
}

TEST(Starter, LandsInTurnedAxes) {
    Grid grid = make_grid(glm::uvec3(61), glm::dvec3(1.0), glm::dvec3(-30.0));
    grid.world_from_index =
        glm::rotate(glm::dmat4(1.0), 0.5, glm::dvec3(1, 2, 3)) * grid.world_from_index;
    const Result<Landing> found = find_landing(distances(grid, glm::dvec3(0.0)), -15.0);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_NEAR(glm::length(found->at_mm), 15.0, 3.0 / (8.0 * 14.0)); // all three axes are across
}

TEST(Starter, PassesByWhatIsThinnerThanTwoSamples) {
    const Grid grid = make_grid(glm::uvec3(41), glm::dvec3(1.0), glm::dvec3(-20.0));
    const auto sheet_and_block = [&](bool block) {
        return make_volume(grid, ScalarType::u8, [=](glm::uvec3 i) {
            return i.y == 5 || (block && i.y >= 20) ? 100.0 : 0.0;
        });
    };
    const Result<Landing> block = find_landing(sheet_and_block(true), 50.0);
    ASSERT_TRUE(block) << block.error().message;
    EXPECT_NEAR(block->at_mm.y, -0.5, 1e-9); // between the samples at -1 mm and 0
    const Result<Landing> sheet = find_landing(sheet_and_block(false), 50.0);
    ASSERT_TRUE(sheet) << sheet.error().message;
    EXPECT_NEAR(sheet->at_mm.y, -15.5, 1e-9);
}

TEST(Starter, SaysWhereNothingCanBeMet) {
    const Grid grid = make_grid(glm::uvec3(9), glm::dvec3(1.0));
    for (const double value : {0.0, 100.0}) {
        const Result<Landing> none = find_landing(
            make_volume(grid, ScalarType::u8, [=](glm::uvec3) { return value; }), 50.0);
        ASSERT_FALSE(none);
        EXPECT_THAT(none.error().message, HasSubstr("meets a surface at 50; values are "));
    }
}

TEST(Starter, PathAndStrokesAreReadBack) {
    const Grid grid = make_grid(glm::uvec3(61), glm::dvec3(1.0), glm::dvec3(-30.0));
    const Volume volume = distances(grid, glm::dvec3(0.0));
    const Landing landing = find_landing(volume, -20.0).value();
    const Result<haptics::HandPath> path =
        haptics::parse_hand_path(starter_path(landing, volume), "path");
    ASSERT_TRUE(path) << path.error().message;
    // 60 mm of side: from 15 mm outside to 2 mm within.
    EXPECT_NEAR(glm::length(path->at(0.0).tool.position_mm), 35.0, 0.05);
    EXPECT_NEAR(glm::length(path->at(1.2).tool.position_mm), 18.0, 0.05);
    EXPECT_EQ(path->at(1.2).buttons, 1u);
    EXPECT_EQ(path->at(2.5).tool.position_mm, path->at(0.0).tool.position_mm);
    EXPECT_EQ(path->at(2.5).buttons, 0u);
    const Result<std::vector<Stroke>> strokes =
        parse_strokes(starter_strokes(landing, volume, -20.0), "strokes");
    ASSERT_TRUE(strokes) << strokes.error().message;
    ASSERT_EQ(strokes->size(), 2u);
    EXPECT_EQ((*strokes)[0].operation.kind, OperationKind::cut);
    EXPECT_EQ((*strokes)[1].operation.kind, OperationKind::mill);
    EXPECT_GT((*strokes)[1].poses.size(), 4u);
}

} // namespace
} // namespace palpate
