// Smooth walls: the iso-surface of a hole is the surface of the tool that cut it. The reference is
// the tool's own function, at every vertex of the mesh.

#include <gtest/gtest.h>

#include "engine/edit/stroke_run.h"
#include "engine/surface/marching_cubes.h"
#include "tests/support/given.h"
#include "tests/unit/edit/random_edit.h"

namespace palpate {
namespace {

const auto kPlaces = uint64_t(std::min(given("PALPATE_STROKES", 25), 100.0));
// Errors of linear interpolation in cells, for what curves and bends as these tools do, in samples.
constexpr double kMostRms = 0.1;

struct Body {
    const char* name;
    ShapePtr (*make)(double sample_mm);
};

const Body kBodies[] = {
    {"ball", [](double s) { return make_ball(3 * s); }},
    {"capsule", [](double s) { return make_capsule(2.5 * s, 5 * s); }},
    {"box",
     [](double s) {
         return make_box({6 * s, 8 * s, 7 * s});
     }},
    {"cylinder", [](double s) { return make_cylinder(3 * s, 7 * s); }},
    {"ellipsoid",
     [](double s) {
         return make_ellipsoid({5 * s, 3 * s, 4 * s});
     }},
};

struct Way {
    const char* name;
    bool oblique; // spacings of 1 : 3, axes turned or mirrored
    bool moving;
    std::optional<double> surface_value;
};

const Way kWays[] = {
    {"Dab", false, false, {}},          {"ObliqueDab", true, false, {}},
    {"Stroke", false, true, {}},        {"ObliqueStroke", true, true, {}},
    {"AtMinus600", false, false, -600}, {"At700", true, true, 700},
};

double distance_mm(const Tool& tool, const ToolPose& pose, glm::dvec3 p) {
    return tool.shape->signed_mm((p - pose.position_mm) * glm::mat3_cast(pose.rotation));
}

// Straight from the tool's function, where of many poses on its way it comes nearest.
double rms_in_samples(const Mesh& mesh, const Tool& tool, const Grid& grid,
                      const std::vector<StrokePose>& poses) {
    constexpr int kParts = 16;
    std::vector<ToolPose> way{poses[0].tool};
    for (size_t i = 1; i < poses.size(); ++i)
        for (int part = 1; part <= kParts; ++part)
            way.push_back(pose_between(poses[i - 1], poses[i], double(part) / kParts).tool);
    const glm::dmat3 to_index = glm::inverse(glm::dmat3(grid.world_from_index));
    double sum = 0.0;
    for (const glm::vec3 vertex : mesh.positions) {
        const glm::dvec3 p(mesh.world_from_mesh * glm::dvec4(glm::dvec3(vertex), 1.0));
        const ToolPose* nearest = &way[0];
        for (const ToolPose& pose : way)
            if (distance_mm(tool, pose, p) < distance_mm(tool, *nearest, p))
                nearest = &pose;
        glm::dvec3 slope;
        constexpr double kStep_mm = 1e-3;
        for (int axis = 0; axis < 3; ++axis) {
            glm::dvec3 step(0.0);
            step[axis] = kStep_mm;
            slope[axis] =
                (distance_mm(tool, *nearest, p + step) - distance_mm(tool, *nearest, p - step)) /
                (2 * kStep_mm);
        }
        // To the surface along its normal, by a step of Newton's; then in samples.
        const glm::dvec3 away = slope * (distance_mm(tool, *nearest, p) / glm::dot(slope, slope));
        const double samples = glm::length(to_index * away);
        sum += samples * samples;
    }
    return std::sqrt(sum / double(mesh.positions.size()));
}

class Walls : public testing::TestWithParam<std::tuple<Body, Way>> {};

// Walls takes over 5 s of a processor: each body cuts a block whose whole surface is meshed, and
// every vertex is compared.
TEST_P(Walls, AreTheToolsOwnSurface) {
    const auto& [body, way] = GetParam();
    double worst = 0.0, mean = 0.0, worst_of_samples = 0.0;
    for (uint64_t seed = 0; seed < kPlaces; ++seed) {
        Random random(seed * 977 + 5);
        Grid grid = make_grid({48, 48, 48}, glm::dvec3(0.8));
        if (way.oblique) {
            grid = make_grid({48, 48, 48}, {0.5, 0.5 * uniform(random, 1, 3), 0.5});
            const glm::dmat3 turn = glm::mat3_cast(random_turn(random));
            grid.world_from_index =
                glm::translate(glm::dmat4(1.0), glm::dvec3(uniform(random, -200, 200))) *
                glm::dmat4(turn * glm::dmat3(grid.world_from_index));
        }
        const glm::dvec3 spacing = spacing_mm(grid);
        const double sample_mm = std::max({spacing.x, spacing.y, spacing.z});
        const Tool tool{body.make(sample_mm)};
        const glm::dvec3 middle(uniform(random, 22, 25), uniform(random, 22, 25),
                                uniform(random, 22, 25));
        std::vector<StrokePose> poses{{0.0, {world_point(grid, middle), random_turn(random)}}};
        if (way.moving)
            for (int i = 1; i < 4; ++i) {
                StrokePose next = poses.back();
                next.tool.position_mm += 0.6 * sample_mm * random_direction(random);
                poses.push_back(next);
            }
        const Volume before = make_volume(grid, ScalarType::i16, [](glm::uvec3) { return 1000.0; });
        Operation cut;
        cut.kind = OperationKind::cut;
        cut.to_value = -1000.0;
        cut.surface_value = way.surface_value;
        for (const enum palpate::Walls walls : {palpate::Walls::smooth, palpate::Walls::samples}) {
            cut.walls = walls;
            if (walls == palpate::Walls::samples)
                cut.surface_value = {};
            const Result<Volume> after = apply_stroke(before, tool, cut, poses);
            ASSERT_TRUE(after) << after.error().message;
            const Mesh mesh = marching_cubes(*after, float(way.surface_value.value_or(0.0)));
            ASSERT_GT(mesh.positions.size(), 100u);
            const double rms = rms_in_samples(mesh, tool, grid, poses);
            if (walls == palpate::Walls::samples) {
                worst_of_samples = std::max(worst_of_samples, rms);
                continue;
            }
            worst = std::max(worst, rms);
            mean += rms / kPlaces;
        }
    }
    RecordProperty("worst_rms_samples", std::to_string(worst));
    printf("%s %s: RMS in samples: worst %.4f, mean %.4f; whole samples: worst %.4f\n", body.name,
           way.name, worst, mean, worst_of_samples);
    EXPECT_LE(worst, kMostRms);
}

INSTANTIATE_TEST_SUITE_P(Bodies, Walls,
                         testing::Combine(testing::ValuesIn(kBodies), testing::ValuesIn(kWays)),
                         [](const auto& cell) {
                             return std::string(std::get<0>(cell.param).name) +
                                    std::get<1>(cell.param).name;
                         });

// A hole in soft tissue is as large as the tool, also where the surface that is felt is bone.
TEST(Walls, InMatterBelowTheSurfaceValueAreThoseWithoutOne) {
    const Volume before = make_volume(make_grid({24, 24, 24}, glm::dvec3(1)), ScalarType::i16,
                                      [](glm::uvec3) { return 30.0; });
    const std::vector<StrokePose> dab{{0.0, {{11.2, 11.6, 11.9}, kUpright}}};
    Operation cut;
    cut.kind = OperationKind::cut;
    cut.to_value = -1024.0;
    const Result<Volume> without = apply_stroke(before, {make_ball(3.0)}, cut, dab);
    cut.surface_value = 300.0;
    const Result<Volume> with = apply_stroke(before, {make_ball(3.0)}, cut, dab);
    ASSERT_TRUE(with && without);
    for (uint32_t z = 0; z < 24; ++z)
        for (uint32_t y = 0; y < 24; ++y)
            for (uint32_t x = 0; x < 24; ++x)
                ASSERT_EQ(with->value({x, y, z}), without->value({x, y, z}));
}

TEST(Walls, OfALongMillAreThoseOfACut) {
    Random random(11);
    for (int i = 0; i < 20; ++i) {
        const Grid grid = random_grid(random, {40, 40, 20});
        const Volume before = make_volume(grid, ScalarType::i16, [](glm::uvec3 p) {
            return 400.0 + double(p.x * 31u % 17u + p.y * 13u % 29u);
        });
        Tool tool = random_tool(random);
        tool.marks_origin = false;
        StrokePose pose = random_pose(random, grid), later = pose;
        later.time_s = 1e4;
        Operation cut, mill;
        cut.kind = OperationKind::cut;
        mill.kind = OperationKind::mill;
        cut.to_value = mill.to_value = -200.0;
        cut.surface_value = mill.surface_value = uniform(random, -100, 450);
        mill.falloff_mm = i % 2 ? 0.0 : 1.0;
        mill.rates = {{0.0, 1e9}};
        if (!tool.shape)
            continue;
        const Result<Volume> by_cut = apply_stroke(before, tool, cut, {{pose}});
        const Result<Volume> by_mill = apply_stroke(before, tool, mill, {{pose, later}});
        ASSERT_TRUE(by_cut && by_mill);
        // A mill does not reach beyond the longest spacing, where shares above a half begin to end.
        const double longest_mm =
            std::max({spacing_mm(grid).x, spacing_mm(grid).y, spacing_mm(grid).z});
        const Sweep sweep(tool, grid, pose, pose);
        for (uint32_t z = 0; z < 20; ++z)
            for (uint32_t y = 0; y < 40; ++y)
                for (uint32_t x = 0; x < 40; ++x) {
                    const glm::dvec3 p = glm::dmat3(grid.world_from_index) * glm::dvec3(x, y, z);
                    if (sweep.near(p).mm < 0.99 * longest_mm) {
                        ASSERT_EQ(by_cut->value({x, y, z}), by_mill->value({x, y, z}));
                    }
                }
    }
}

} // namespace
} // namespace palpate
