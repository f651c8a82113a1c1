#include "engine/segment/guide_field.h"

#include <gmock/gmock.h>

#include "engine/volume/builder.h"
#include "engine/volume/grid.h"
#include "engine/volume/sample.h"

namespace palpate {
namespace {

using testing::HasSubstr;

const Grid kGrid = make_grid({30, 28, 14}, {1.0, 1.0, 2.0}, {5, -3, 7});
const glm::dvec3 kMiddle = world_point(kGrid, 0.5 * (glm::dvec3(kGrid.size) - 1.0));

double from_ball(glm::uvec3 at) {
    return glm::length(world_point(kGrid, glm::dvec3(at)) - kMiddle) - 8.0;
}

double at_mm(const Volume& field, glm::dvec3 mm) {
    return trilinear(field, index_point(field.grid(), mm));
}

TEST(GuideField, OfLabelsIsTheirDistanceBeyondTheVolumeToo) {
    const Volume labels =
        make_volume(kGrid, ScalarType::u8, [](glm::uvec3 i) { return from_ball(i) < 0.0 ? 3 : 0; });
    const Volume field = *guide_to_labels(labels, INFINITY, {});
    EXPECT_EQ(field.size(), kGrid.size + 2u * kGuideMargin);
    for (const glm::dvec3 way : {glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(0, 0, 1)})
        for (const double r : {2.0, 5.0, 10.0, 15.0, 17.0}) // the volume ends at 13 to 14.5 mm
            // Labels tell the place of a surface to half a sample on each axis, and half a
            // millimetre stands for half a sample of 2 mm.
            EXPECT_NEAR(at_mm(field, kMiddle + r * way), r - 8.0,
                        0.5 * std::sqrt(1 + 1 + 4.0) + 0.5);
    const Volume near = *guide_to_labels(labels, 3.0, {});
    EXPECT_EQ(near.range().max, 3.0f);
    // The distance of a wall is exact: its samples end at x = 5.
    const Grid grid = make_grid({12, 9, 9}, glm::dvec3(1.0));
    const Volume wall = *guide_to_labels(
        make_volume(grid, ScalarType::u8, [](glm::uvec3 i) { return i.x <= 5 ? 1.0 : 0.0; }), 9.0,
        {});
    for (const double x : {4.0, 5.0, 5.5, 6.0, 7.5, 11.0})
        EXPECT_NEAR(at_mm(wall, {x, 4, 4}), x - 5.5, 1e-6);
    const Volume none = make_volume(kGrid, ScalarType::u8, [](glm::uvec3) { return 0.0; });
    EXPECT_THAT(guide_to_labels(none, 3.0, {}).error().message, HasSubstr("found none"));
}

TEST(GuideField, OfEdgesIsTheDistanceToTheBoundaryOfABall) {
    const Volume volume = make_volume(kGrid, ScalarType::f32, [](glm::uvec3 i) {
        return 100.0 / (1.0 + std::exp(2.0 * from_ball(i)));
    });
    const Volume field = *guide_to_edges(volume, {.sigma_mm = 0.0, .least = 5.0}, {});
    for (const glm::dvec3 way : {glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(0, 0, 1)})
        for (const double r : {3.5, 5.0, 11.0, 12.5})
            EXPECT_NEAR(at_mm(field, kMiddle + r * way), std::abs(r - 8.0),
                        0.5 * std::sqrt(1 + 1 + 4.0) + 0.5);
    EXPECT_LE(field.range().max, 6.0f);
    EXPECT_LT(at_mm(field, kMiddle + glm::dvec3(8, 0, 0)), 0.6);
    const Volume flat = make_volume(kGrid, ScalarType::f32, [](glm::uvec3) { return 7.0; });
    EXPECT_THAT(guide_to_edges(flat, {}, {}).error().message, HasSubstr("found no edge"));
}

TEST(GuideField, OfAPlaneIsExact) {
    const glm::dvec3 normal = glm::normalize(glm::dvec3(1, 2, -2));
    const Volume field = *guide_to_plane(kGrid, kMiddle, 5.0 * normal);
    for (const glm::dvec3 off : {glm::dvec3(0, 0, 0), glm::dvec3(3, -5, 4), glm::dvec3(-12, 9, 8)})
        EXPECT_NEAR(at_mm(field, kMiddle + off), glm::dot(off, normal), 1e-5);
    EXPECT_THAT(guide_to_plane(kGrid, kMiddle, {}).error().message, HasSubstr("no length"));
}

} // namespace
} // namespace palpate
