#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "engine/mesh/topology.h"
#include "engine/surface/marching_cubes.h"
#include "engine/volume/synthetic.h"

namespace palpate::testing {

inline Grid centred_grid(uint32_t side, double half_mm) {
    const double step = 2.0 * half_mm / (side - 1);
    return make_grid(glm::uvec3(side), glm::dvec3(step), glm::dvec3(-half_mm));
}

inline void expect_sound(const MeshTopology& found) {
    EXPECT_TRUE(found.closed);
    EXPECT_TRUE(found.manifold);
    EXPECT_TRUE(found.consistently_oriented);
    EXPECT_EQ(found.duplicate_triangles, 0u);
    EXPECT_EQ(found.zero_area_triangles, 0u);
    EXPECT_EQ(found.degenerate_triangles, 0u);
}

// For fields without a known exact area or volume: each halving of the spacing moves both by a
// quarter of what the one before did, or by less where leading terms cancel. Closed at the border,
// whose walls are the same but for 2^-12 of a sample.
inline void expect_order_two(const synthetic::Field& field, float iso,
                             std::array<uint32_t, 3> sides) {
    std::array<double, 3> area, volume;
    for (size_t i = 0; i < 3; ++i) {
        const MeshTopology found = topology(
            marching_cubes(synthetic::sample(field, centred_grid(sides[i], 15.0), ScalarType::f32),
                           iso, {.normals = SurfaceNormals::none, .closed_at_border = true}));
        expect_sound(found);
        area[i] = found.area_mm2;
        volume[i] = found.volume_mm3;
    }
    for (const auto& a : {area, volume})
        EXPECT_GT(std::log2(std::abs((a[1] - a[0]) / (a[2] - a[1]))), 1.8);
}

} // namespace palpate::testing
