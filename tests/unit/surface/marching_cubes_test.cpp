#include "engine/surface/marching_cubes.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <random>

#include "engine/mesh/topology.h"
#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"
#include "tests/unit/surface/naive.h"
#include "tests/unit/surface/random_edits.h"
#include "tests/unit/surface/shapes.h"

namespace palpate {
namespace {

using testing::centred_grid;
using testing::expect_same_bytes;
using testing::expect_sound;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr double kPi = std::numbers::pi;

// The same vertices and triangles in the same order. Positions: the engine adds sample and fraction
// and multiplies by the spacing in float, each rounded by 2^-24 of at most `extent_mm`, and divides
// in float (the fraction is good to a few 2^-24): 4 x 2^-24 x extent_mm. Normals: a component of
// the gradient is a sum of four differences of samples of at most `magnitude` over the spacing,
// each rounded a few times, so that the gradient is good to some 32 x 2^-24 x magnitude / spacing,
// and its direction to that over its length. Where it is shorter than 1000 times that, its
// direction is left alone; normals within cells are held against none.
void expect_equal(const Mesh& mesh, const testing::NaiveMesh& naive, double extent_mm,
                  double magnitude, double least_spacing_mm) {
    ASSERT_EQ(mesh.positions.size(), naive.positions.size());
    ASSERT_EQ(mesh.triangles, naive.triangles);
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
        const double error = glm::length(glm::dvec3(mesh.positions[i]) - naive.positions[i]);
        ASSERT_LE(error, 4.0 * 0x1p-24 * extent_mm * std::sqrt(3.0)) << "vertex " << i;
    }
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
    const double gradient_error = 32.0 * 0x1p-24 * magnitude / least_spacing_mm;
    size_t compared = 0;
    for (size_t i = 0; i < mesh.normals.size(); ++i) {
        ASSERT_NEAR(glm::length(glm::dvec3(mesh.normals[i])), 1.0, 3.0 * 0x1p-24) << "vertex " << i;
        if (naive.slopes[i] < 1000.0 * gradient_error)
            continue;
        ++compared;
        ASSERT_LE(glm::length(glm::dvec3(mesh.normals[i]) - naive.normals[i]),
                  2.0 * gradient_error / naive.slopes[i] + 3.0 * 0x1p-24)
            << "vertex " << i;
    }
    EXPECT_GT(compared, mesh.normals.size() / 2);
}

Volume random_volume(glm::uvec3 size, ScalarType type, int levels, uint32_t seed,
                     double gap_share = 0.0) {
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> level(0, levels - 1);
    std::bernoulli_distribution gap(gap_share);
    const Grid grid = make_grid(size, {0.5, 0.75, 3.0}, {10.0, 20.0, 30.0});
    std::vector<double> values(sample_count(grid));
    for (double& v : values)
        v = gap(random) ? std::numeric_limits<double>::quiet_NaN() : level(random);
    return make_volume(grid, type, [&](glm::uvec3 i) {
        return values[i.x + size_t{size.x} * (i.y + size_t{size.y} * i.z)];
    });
}

// Noise crosses every block, in every case, with many ties; sizes that end within blocks and
// bricks.
TEST(MarchingCubes, EqualsTheNaiveOneOnNoise) {
    const glm::uvec3 size(35, 11, 34);
    for (const ScalarType type :
         {ScalarType::u8, ScalarType::i8, ScalarType::u16, ScalarType::i16, ScalarType::f32})
        for (const SurfaceTopology topology : {SurfaceTopology::classic, SurfaceTopology::correct})
            for (const bool closed : {false, true}) {
                if (type != ScalarType::f32 && type != ScalarType::i16 && closed)
                    continue;
                const Volume volume = random_volume(size, type, 5, 7);
                for (const float iso : {2.0f, 2.5f}) {
                    if (type != ScalarType::f32 && iso == 2.5f)
                        continue;
                    const SurfaceOptions options{.topology = topology, .closed_at_border = closed};
                    SCOPED_TRACE(fmt::format("{} iso {} topology {} closed {}", name_of(type), iso,
                                             static_cast<int>(topology), closed));
                    expect_equal(marching_cubes(volume, iso, options),
                                 testing::Naive(volume, iso, options).extract(), 110.0, 4.0, 0.5);
                }
            }
}

TEST(MarchingCubes, GapsAreOutsideAndWalledOff) {
    const Volume volume = random_volume({19, 33, 11}, ScalarType::f32, 4, 3, 0.2);
    for (const SurfaceTopology topology : {SurfaceTopology::classic, SurfaceTopology::correct}) {
        const SurfaceOptions options{.topology = topology, .closed_at_border = true};
        const Mesh mesh = marching_cubes(volume, 2.0f, options);
        expect_equal(mesh, testing::Naive(volume, 2.0f, options).extract(), 40.0, 3.0, 0.5);
        const MeshTopology found = palpate::topology(mesh);
        EXPECT_TRUE(found.closed);
        EXPECT_EQ(found.non_manifold_edges, 0u);
    }
}

Mesh with_threads(size_t threads, const Volume& volume, float iso, const SurfaceOptions& options) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return marching_cubes(volume, iso, options);
}

TEST(MarchingCubes, OneThreadGivesTheBytesOfMany) {
    const Volume volume = random_volume({70, 65, 40}, ScalarType::i16, 50, 11);
    for (const SurfaceTopology topology : {SurfaceTopology::classic, SurfaceTopology::correct})
        for (const SurfaceNormals normals :
             {SurfaceNormals::none, SurfaceNormals::gradient, SurfaceNormals::triangles}) {
            const SurfaceOptions options{topology, normals, false};
            const Mesh one = with_threads(1, volume, 20.5f, options);
            ASSERT_FALSE(one.triangles.empty());
            expect_same_bytes(one, with_threads(2, volume, 20.5f, options));
            expect_same_bytes(one, with_threads(5, volume, 20.5f, options));
        }
}

TEST(MarchingCubes, AskedToStopThereIsNoMeshOrAllOfIt) {
    const Volume volume = random_volume({70, 65, 40}, ScalarType::i16, 50, 11);
    std::stop_source asked;
    asked.request_stop();
    SurfaceStages stages;
    const Mesh none = marching_cubes(volume, 20.5f, {.stop = asked.get_token()}, &stages);
    EXPECT_TRUE(none.positions.empty() && none.normals.empty() && none.triangles.empty());
    EXPECT_EQ(none.world_from_mesh, world_from_mesh(volume.grid()));
    EXPECT_EQ(stages.bricks_read, 0u);
    EXPECT_EQ(stages.blocks_crossed, 0u);
    // Asked at any time while it works.
    const Mesh all = marching_cubes(volume, 20.5f);
    for (int i = 0; i < 50; ++i) {
        std::stop_source source;
        std::thread asks([&] {
            for (int n = 0; n < i * 2000; ++n)
                std::atomic_signal_fence(std::memory_order_seq_cst);
            source.request_stop();
        });
        const Mesh mesh = marching_cubes(volume, 20.5f, {.stop = source.get_token()});
        asks.join();
        if (mesh.triangles.empty())
            EXPECT_TRUE(mesh.positions.empty() && mesh.normals.empty());
        else
            expect_same_bytes(mesh, all);
    }
}

struct Shape {
    const char* name;
    synthetic::Field field;
    float iso;
    int64_t euler_number;
    double area_mm2, volume_mm3; // 0: unknown
};
constexpr double kRadius_mm = 10.0, kRing_mm = 9.0, kTube_mm = 4.0;

// The shapes; for the Gaussian, its exact sphere: exp(-r^2 / (2 sigma^2)) = iso.
std::vector<Shape> shapes() {
    const double sigma = 6.0, r = sigma * std::sqrt(-2.0 * std::log(0.25));
    return {
        {"sphere", synthetic::sphere_distance({}, kRadius_mm), 0.0f, 2,
         4.0 * kPi * kRadius_mm * kRadius_mm,
         4.0 / 3.0 * kPi * kRadius_mm * kRadius_mm * kRadius_mm},
        {"torus", synthetic::torus({}, kRing_mm, kTube_mm), 0.0f, 0,
         4.0 * kPi * kPi * kRing_mm * kTube_mm, 2.0 * kPi * kPi * kRing_mm * kTube_mm * kTube_mm},
        {"gaussian", synthetic::gaussian({}, sigma, 1.0), 0.25f, 2, 4.0 * kPi * r * r,
         4.0 / 3.0 * kPi * r * r * r},
    };
}

// Halving the spacing quarters the errors of area and volume: order 2, fitted to three sizes.
TEST(MarchingCubes, SphereTorusAndGaussianAreClosedAndConvergeAtOrderTwo) {
    for (const Shape& shape : shapes()) {
        SCOPED_TRACE(shape.name);
        std::vector<double> area_error, volume_error;
        for (const uint32_t side : {25u, 49u, 97u}) {
            const Volume volume =
                synthetic::sample(shape.field, centred_grid(side, 15.0), ScalarType::f32);
            const MeshTopology found = topology(marching_cubes(volume, shape.iso));
            expect_sound(found);
            EXPECT_EQ(found.components.size(), 1u);
            EXPECT_EQ(found.euler_number, shape.euler_number);
            area_error.push_back(std::abs(found.area_mm2 - shape.area_mm2));
            volume_error.push_back(std::abs(found.volume_mm3 - shape.volume_mm3));
            EXPECT_GT(found.volume_mm3, 0.0); // facing outward
        }
        for (const auto& error : {area_error, volume_error}) {
            const double order = std::log2(error[0] / error[2]) / 2.0;
            EXPECT_GT(order, 1.9);
            EXPECT_LT(order, 2.2);
        }
    }
}

// The genus of a closed gyroid is not known from outside; but the mesh's Euler number must agree
// between the modes, which differ only where a cell is ambiguous, and none is at this resolution.
TEST(MarchingCubes, GyroidAndMarschnerLobbAreClosed) {
    const SurfaceOptions closed{.closed_at_border = true};
    const Volume gyroid =
        synthetic::sample(synthetic::gyroid(20.0), centred_grid(60, 20.0), ScalarType::f32);
    const Mesh classic = marching_cubes(gyroid, 0.0f, closed);
    expect_sound(topology(classic));
    // Marschner and Lobb's ripples at 40 samples a side are near the lattice's limit.
    const Volume lobb =
        synthetic::sample(synthetic::marschner_lobb(20.0), centred_grid(40, 20.0), ScalarType::f32);
    for (const SurfaceTopology mode : {SurfaceTopology::classic, SurfaceTopology::correct}) {
        expect_sound(
            topology(marching_cubes(gyroid, 0.0f, {.topology = mode, .closed_at_border = true})));
        expect_sound(
            topology(marching_cubes(lobb, 0.5f, {.topology = mode, .closed_at_border = true})));
    }
    expect_same_bytes(
        classic, marching_cubes(gyroid, 0.0f,
                                {.topology = SurfaceTopology::correct, .closed_at_border = true}));
}

// Fields with bounds on their first and second derivative along an axis, per mm and per mm^2.
struct Bounded {
    const char* name;
    synthetic::Field field;
    float iso;
    double slope, bend;
};
std::vector<Bounded> bounded_fields(double h) {
    const double sigma = 6.0, w = 2.0 * kPi / 20.0;
    // Marschner & Lobb: (1 - sin(pi z / 2) + a (1 + cos(2 pi f cos(pi r / 2)))) / (2 (1 + a)), f =
    // 6, a = 1 / 4, in units of 20 mm. The cosine of a function g with g' at most pi^2 f and g'' at
    // most pi^3 f / 2, along r and, by (g' / r), across it.
    const double unit = 1.0 / 20.0, share = 0.25 / 2.5;
    const double lobb_slope = share * kPi * kPi * 6.0 + kPi / 2.0 / 2.5;
    const double lobb_bend = share * (std::pow(kPi * kPi * 6.0, 2) + 2.0 * kPi * kPi * kPi * 3.0) +
                             kPi * kPi / 4.0 / 2.5;
    return {
        // The bend of a distance is at most one over the distance to where it is not smooth.
        {"sphere", synthetic::sphere_distance({}, kRadius_mm), 0.0f, 1.0, 1.0 / (kRadius_mm - h)},
        {"torus", synthetic::torus({}, kRing_mm, kTube_mm), 0.0f, 1.0, 1.0 / (kTube_mm - h)},
        {"gaussian", synthetic::gaussian({}, sigma, 1.0), 0.25f, std::exp(-0.5) / sigma,
         1.0 / (sigma * sigma)},
        // sin X cos Y + sin Z cos X has an amplitude of at most sqrt 2.
        {"gyroid", synthetic::gyroid(20.0), 0.25f, std::sqrt(2.0) * w, std::sqrt(2.0) * w * w},
        {"marschner_lobb", synthetic::marschner_lobb(20.0), 0.5f, lobb_slope * unit,
         lobb_bend * unit * unit},
    };
}

// Along an edge of length h, linear interpolation is off by at most h^2 / 8 times the bend; so that
// is how far the field at a vertex may be from iso. Clamping moves a vertex by 2^-12 h at most,
// float values (below 40) and positions (below 40 mm) round by 2^-24 of them, a few times. For a
// distance the field's value is the vertex's distance from the surface.
TEST(MarchingCubes, VerticesLieWithinTheDerivedBoundOfTheTrueSurface) {
    for (const uint32_t side : {16u, 31u, 61u})
        for (size_t f = 0; f < bounded_fields(1.0).size(); ++f) {
            const Grid grid = centred_grid(side, 15.0);
            const double h = spacing_mm(grid).x;
            const Bounded b = bounded_fields(h)[f];
            SCOPED_TRACE(fmt::format("{}, {} samples a side", b.name, side));
            const Mesh mesh =
                marching_cubes(synthetic::sample(b.field, grid, ScalarType::f32), b.iso);
            const double bound = h * h / 8.0 * b.bend + 0x1p-12 * h * b.slope +
                                 8.0 * 0x1p-24 * 40.0 * std::max(1.0, b.slope);
            double worst = 0.0;
            ASSERT_GT(mesh.positions.size(), 100u);
            for (const glm::vec3& position : mesh.positions) {
                const glm::dvec3 p(mesh.world_from_mesh * glm::dvec4(position, 1.0));
                worst = std::max(worst, std::abs(b.field.value(p) - double{b.iso}));
            }
            EXPECT_LE(worst, bound);
            EXPECT_GT(worst, bound / 100.0) << "a bound that says something";
        }
}

// Central differences of a distance are off by h^2 / 6 of its third derivative, at most
// 3 / (R - 2h)^2 in any direction, and interpolation by h^2 / 8 of the same, on each axis.
TEST(MarchingCubes, NormalsLieWithinTheDerivedBoundOfTheSphere) {
    for (const uint32_t side : {31u, 61u}) {
        const Grid grid = centred_grid(side, 15.0);
        const double h = spacing_mm(grid).x, smooth_mm = kRadius_mm - 2 * h;
        const Mesh mesh = marching_cubes(
            synthetic::sample(synthetic::sphere_distance({}, kRadius_mm), grid, ScalarType::f32),
            0.0f);
        const double off =
            std::sqrt(3.0) * (1.0 / 6.0 + 1.0 / 8.0) * h * h * 3.0 / (smooth_mm * smooth_mm);
        for (size_t i = 0; i < mesh.positions.size(); ++i) {
            const glm::dvec3 p(mesh.world_from_mesh * glm::dvec4(mesh.positions[i], 1.0));
            EXPECT_LE(glm::length(glm::dvec3(mesh.normals[i]) - glm::normalize(p)), off) << side;
        }
    }
}

TEST(MarchingCubes, GyroidConvergesAtOrderTwo) {
    testing::expect_order_two(synthetic::gyroid(20.0), 0.25f, {25, 49, 97});
}

TEST(MarchingCubes, UnevenSpacingIsInPositionsAndNormals) {
    const Grid grid = make_grid({61, 61, 13}, {0.5, 0.5, 2.5}, {-15.0, -15.0, -15.0});
    const synthetic::Field field = synthetic::ramp({1.0, 2.0, 3.0}, 0.1);
    const Mesh mesh = marching_cubes(synthetic::sample(field, grid, ScalarType::f32), 0.0f);
    const glm::dvec3 outward = -glm::normalize(glm::dvec3(1.0, 2.0, 3.0));
    ASSERT_GT(mesh.positions.size(), 100u);
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
        const glm::dvec3 p(mesh.world_from_mesh * glm::dvec4(mesh.positions[i], 1.0));
        // Values up to 90 in float, clamping 2^-12 of an edge, along which the value changes
        // by 7.5.
        EXPECT_LE(std::abs(field.value(p)), 0x1p-12 * 7.5 + 8.0 * 0x1p-24 * 90.0);
        // At the border, differences are half as large on one axis.
        const glm::vec3 index = mesh.positions[i] / glm::vec3(spacing_mm(grid));
        const bool within = glm::all(glm::greaterThan(index, glm::vec3(1.0f))) &&
                            glm::all(glm::lessThan(index, glm::vec3(grid.size) - 2.0f));
        if (within) {
            EXPECT_GT(glm::dot(glm::dvec3(mesh.normals[i]), outward), 1.0 - 1e-6);
        }
    }
}

TEST(MarchingCubes, NormalsFromTrianglesAreThoseOfTheMesh) {
    const Volume volume = synthetic::sample(synthetic::sphere_distance({}, kRadius_mm),
                                            centred_grid(31, 15.0), ScalarType::f32);
    const Mesh mesh = marching_cubes(volume, 0.0f, {.normals = SurfaceNormals::triangles});
    EXPECT_EQ(mesh.normals, vertex_normals(mesh));
    EXPECT_TRUE(marching_cubes(volume, 0.0f, {.normals = SurfaceNormals::none}).normals.empty());
}

Volume from_values(glm::uvec3 size, std::vector<float> values) {
    return make_volume<float>(make_grid(size, glm::dvec3(1.0)), values);
}

TEST(MarchingCubes, NothingToExtractIsAnEmptyMesh) {
    const Volume flat = from_values({5, 5, 5}, std::vector<float>(125, 3.0f));
    const Volume ramp = synthetic::sample(synthetic::ramp({1, 0, 0}),
                                          make_grid({40, 9, 9}, {1, 1, 1}), ScalarType::i16);
    const float infinity = std::numeric_limits<float>::infinity();
    for (const float iso : {-1.0f, 0.0f, 1000.0f, kNan, infinity, -infinity})
        EXPECT_TRUE(marching_cubes(ramp, iso).triangles.empty()) << iso;
    for (const float iso : {2.0f, 3.0f, 4.0f})
        EXPECT_TRUE(marching_cubes(flat, iso).positions.empty()) << iso;
    EXPECT_FALSE(marching_cubes(ramp, 39.0f).triangles.empty()); // equal to the last sample
    const Volume gaps = from_values({4, 4, 4}, std::vector<float>(64, kNan));
    for (const bool closed : {false, true})
        EXPECT_TRUE(marching_cubes(gaps, 0.0f, {.closed_at_border = closed}).triangles.empty());
}

TEST(MarchingCubes, WhatIsInsideTheBorderIsABoxWhenClosed) {
    for (const glm::uvec3 size : {glm::uvec3(5, 5, 5), glm::uvec3(1, 1, 1), glm::uvec3(1, 7, 40),
                                  glm::uvec3(32, 8, 33), glm::uvec3(31, 9, 1)})
        for (const float iso : {3.0f, -1.0f, -std::numeric_limits<float>::infinity()}) {
            const Volume flat =
                from_values(size, std::vector<float>(size_t{size.x} * size.y * size.z, 3.0f));
            const Mesh mesh = marching_cubes(flat, iso, {.closed_at_border = true});
            const MeshTopology found = topology(mesh);
            expect_sound(found);
            EXPECT_EQ(found.euler_number, 2);
            // Walls stand 2^-12 of a sample outside the outermost samples; edges are cut off.
            const glm::dvec3 side = glm::dvec3(size) - 1.0 + 2.0 * 0x1p-12;
            EXPECT_LE(found.volume_mm3, side.x * side.y * side.z);
            EXPECT_GE(found.volume_mm3, side.x * side.y * side.z -
                                            4.0 * (side.x + side.y + side.z) * 0x1p-12 * 0x1p-12);
            EXPECT_TRUE(marching_cubes(flat, iso).triangles.empty());
        }
}

TEST(MarchingCubes, SizeOneInAnAxisHasNoCells) {
    for (const glm::uvec3 size :
         {glm::uvec3(1, 20, 20), glm::uvec3(20, 1, 20), glm::uvec3(20, 20, 1), glm::uvec3(1)}) {
        const Mesh mesh = marching_cubes(random_volume(size, ScalarType::u8, 4, 5), 2.0f);
        EXPECT_TRUE(mesh.triangles.empty());
    }
}

// A single sample is an octahedron, a hole in the data around it or not; its size follows the
// value.
TEST(MarchingCubes, OneVoxelIsAnOctahedronOfItsHeight) {
    for (const float iso : {0.25f, 0.5f, 1.0f}) {
        std::vector<float> values(11 * 11 * 11, 0.0f);
        values[5 + 11 * (5 + 11 * 5)] = 1.0f;
        const MeshTopology found = topology(marching_cubes(from_values({11, 11, 11}, values), iso));
        expect_sound(found);
        EXPECT_EQ(found.triangles, 8u);
        EXPECT_EQ(found.euler_number, 2);
        const double reach = std::max(1.0 - iso, 0x1p-12);
        EXPECT_NEAR(found.volume_mm3, 4.0 / 3.0 * reach * reach * reach,
                    20.0 * 0x1p-24 * 6.0 * reach * reach);
    }
}

// Two blocks that break other programs: scikit-image 8109 and 8116 name the first (duplicate faces)
// and the kind of the second (holes where the level equals samples).
TEST(MarchingCubes, CounterExamplesOfOthersAreSound) {
    const std::vector<float> duplicate{13, -1, -1, -7, -1, 1, 7, -7, 15, -9, -3, -1};
    const std::vector<float> ties{0, 1, 0, 1, 0, 1, 0, 1,  0, -1, 0, -1, 0, -1,
                                  0, 1, 0, 1, 0, 1, 0, -1, 0, 1,  0, -1, 0};
    for (const SurfaceTopology mode : {SurfaceTopology::classic, SurfaceTopology::correct})
        for (const float iso : {0.0f, 1.0f, -1.0f}) {
            const SurfaceOptions options{.topology = mode, .closed_at_border = true};
            expect_sound(topology(marching_cubes(from_values({2, 2, 3}, duplicate), iso, options)));
            expect_sound(topology(marching_cubes(from_values({3, 3, 3}, ties), iso, options)));
        }
}

TEST(MarchingCubes, BricksOnOneSideAreNotRead) {
    const Volume volume = synthetic::sample(synthetic::sphere_distance({}, 5.0),
                                            centred_grid(160, 80.0), ScalarType::f32);
    SurfaceStages stages;
    const Mesh mesh = marching_cubes(volume, 0.0f, {}, &stages);
    EXPECT_EQ(topology(mesh).euler_number, 2);
    EXPECT_EQ(stages.bricks, 125u);
    EXPECT_EQ(stages.bricks_read, 1u);
    // A ball of 11 samples across lies in 2 x 2 x 2 blocks of the middle brick.
    EXPECT_EQ(stages.blocks_crossed, 8u);
}

} // namespace
} // namespace palpate
