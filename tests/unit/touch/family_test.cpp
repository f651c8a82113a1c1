// The family of scenes that is not to be fitted, and a small share of it with every algorithm.

#include "bench/touch/family.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bench/touch/open_loop.h"
#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"
#include "haptics/field/field.h"
#include "haptics/proxy/algorithms.h"

namespace palpate::touch {
namespace {

// A draw of every body, edge, noise and grid; its values say where the surface is: on a way out
// along the normal they fall through the iso-value near the touched point, by less than the edge is
// wide.
TEST(Family, VolumesHoldTheirBodies) {
    // Two tori last: none of the first twelve is one.
    for (const uint64_t seed : {1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u, 9u, 10u, 11u, 12u, 3001u, 3002u}) {
        const Edge edge = static_cast<Edge>(seed % kEdges);
        const FamilyScene made = family_scene(seed, edge, {Noise::none, 0.0});
        const TouchCase& body = made.scene.body;
        EXPECT_NEAR(body.solid.distance_mm(body.touch_mm), 0.0, 1e-6) << made.name;
        auto field = std::make_unique<haptics::Field>();
        haptics::TouchParameters parameters = scene_parameters(made.scene);
        parameters.normal_blur_samples = 0.0;
        field->follow(*made.scene.touch.grey, parameters);
        const double voxel = voxel_mm(made.scene.storage);
        EXPECT_GT(field->trilinear(body.touch_mm - 1.5 * voxel * body.normal), 500.0) << made.name;
        EXPECT_LT(field->trilinear(body.touch_mm + 1.5 * voxel * body.normal), 500.0) << made.name;
        const FamilyScene again = family_scene(seed, edge, {Noise::none, 0.0});
        EXPECT_EQ(again.name, made.name);
        EXPECT_EQ(again.scene.touch.grey->value({20, 21, 22}),
                  made.scene.touch.grey->value({20, 21, 22}));
    }
    EXPECT_EQ(family_cells(1).size(), kEdges + kNoises.size());
}

// A hand begins, and but for one that is held ends, in the free, also in a cavity that is not as
// wide as a tap is high (seed 5008): a proxy that begins in material says nothing.
TEST(Family, HandsComeFromTheFree) {
    for (uint64_t i = 0; i <= 40; ++i) {
        const uint64_t seed = i == 0 ? 5008 : i;
        const FamilyScene made = family_scene(seed, Edge{}, {Noise::none, 0.0});
        const TouchCase& body = made.scene.body;
        const glm::dvec3 lifted = 1.5 * voxel_mm(made.scene.storage) * body.normal;
        for (const auto& [hand, slides, rests_from] : family_hands(body, seed)) {
            EXPECT_GT(body.solid.distance_mm(hand.path.front() + lifted), 0.0)
                << made.name << ", " << hand.name;
            if (slides || hand.name == "tap 3 m/s") {
                EXPECT_GT(body.solid.distance_mm(hand.path.back() + lifted), 0.0)
                    << made.name << ", " << hand.name;
            }
        }
    }
}

// Half of the samples of a masked volume are one value: that is no proof of a clean scanner.
TEST(Tuning, AMaskedBackgroundIsNotTakenForClean) {
    const Grid grid = scene_grid({});
    for (const double noise : {0.0, 0.05, 0.1}) {
        const Volume volume = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
            const bool is_free = world_point(grid, glm::dvec3(i)).z > 0.0;
            return is_free ? 0.0 : 1000.0 * (1.0 + noise * synthetic::noise(i, 1));
        });
        const haptics::Tuning tuning = haptics::tuning_for(volume, 500.0);
        EXPECT_EQ(tuning.normal_blur_samples, noise > 0.0 ? 1.0 : 0.0) << noise;
    }
}

// An edge's width is its standard deviation whatever its shape, nearly along an axis and at a
// slant, on even and uneven spacing. A tenth of what it is set against, 0.6 samples, is near
// enough. Where a plane is along an axis to the last digit all lines meet the edge in the same
// places, and two samples in a ramp of one tell its width to a half only: p (1 - p) - 1/12 is from
// 0 to 1/6.
TEST(Tuning, MeasuresTheEdgeOfAnyShape) {
    struct Profile {
        const char* name;
        double (*of)(double samples);
        double deviation;
    };
    const Profile profiles[] = {
        {"erf/0.4", [](double u) { return 0.5 * std::erfc(-u / 0.4 / std::sqrt(2.0)); }, 0.4},
        {"erf/0.7", [](double u) { return 0.5 * std::erfc(-u / 0.7 / std::sqrt(2.0)); }, 0.7},
        {"ramp/1", [](double u) { return std::clamp(0.5 + u, 0.0, 1.0); }, std::sqrt(1.0 / 12.0)},
        {"ramp/2", [](double u) { return std::clamp(0.5 + u / 2.0, 0.0, 1.0); },
         std::sqrt(4.0 / 12.0)},
        {"erf/1.2, counted as 1",
         [](double u) { return 0.5 * std::erfc(-u / 1.2 / std::sqrt(2.0)); }, 1.0}};
    for (const glm::dvec3 spacing : {glm::dvec3(0.5), kUneven_mm})
        for (const glm::dvec3 n : {glm::normalize(glm::dvec3(1, 2, 20)), glm::dvec3(2, 3, 6) / 7.0,
                                   glm::normalize(glm::dvec3(1, 1, 1))}) {
            const Storage storage{.spacing_mm = spacing};
            const Grid grid = scene_grid(storage);
            for (const Profile& profile : profiles) {
                const Volume volume = make_volume(grid, ScalarType::f32, [&](glm::uvec3 i) {
                    const double mm = -glm::dot(n, world_point(grid, glm::dvec3(i)));
                    return 1000.0 * profile.of(mm / voxel_mm(storage));
                });
                EXPECT_NEAR(haptics::tuning_for(volume, 500.0).edge_samples, profile.deviation,
                            0.06)
                    << profile.name << ", " << spacing.x << " mm, " << n.z;
            }
        }
}

// Nothing is passed, nothing is not a number, and no force exceeds its spring, whatever the edge,
// noise and speed.
TEST(Family, NothingIsPassed) {
    uint64_t ticks = 0;
    for (const uint64_t seed : {2u, 9u})
        for (const FamilyCell& cell : family_cells(seed)) {
            if ((static_cast<size_t>(cell.edge) + seed) % 5 != 0)
                continue;
            const FamilyScene made = family_scene(seed, cell.edge, cell.level);
            haptics::TouchParameters parameters = scene_parameters(made.scene);
            tune(parameters, *made.scene.touch.grey);
            for (const char* name : {"swept-point", "swept-tool", "swept-local"}) {
                parameters.tool_radius_mm = name == std::string_view("swept-tool")
                                                ? 1.5 * voxel_mm(made.scene.storage)
                                                : 0.0;
                for (const FamilyHand& hand : family_hands(made.scene.body, seed)) {
                    Trajectory moved = hand.trajectory;
                    for (glm::dvec3& x : moved.path)
                        x += parameters.tool_radius_mm * made.scene.body.normal;
                    const auto algorithm = haptics::find_algorithm(name)->make();
                    const Figures f = open_loop(*algorithm, made.scene, moved, parameters);
                    EXPECT_EQ(f.pop_throughs, 0u)
                        << name << ", " << made.name << ", " << moved.name;
                    EXPECT_EQ(f.not_finite, 0u) << name << ", " << made.name << ", " << moved.name;
                    EXPECT_LE(f.beyond_spring_n, 1e-6) << name << ", " << made.name;
                    ticks += f.ticks;
                }
            }
        }
    EXPECT_GT(ticks, 50'000u);
}

} // namespace
} // namespace palpate::touch
