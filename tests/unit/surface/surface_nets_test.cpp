#include "engine/surface/surface_nets.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <random>
#include <set>

#include "engine/mesh/distance.h"
#include "engine/mesh/topology.h"
#include "engine/surface/net_cell.h"
#include "engine/volume/builder.h"
#include "tests/support/label_volumes.h"

namespace palpate {
namespace {

constexpr glm::dvec3 kSpacing{0.5, 0.75, 2.0};
constexpr double kVoxel_mm3 = 0.75;

Volume make_labels(glm::uvec3 size, const std::function<double(glm::uvec3)>& value,
                   ScalarType type = ScalarType::u16) {
    return make_volume(make_grid(size, kSpacing, {-5, 7, 100}), type, value);
}

// Every sample drawn by chance, or balls of labels over one another.
Volume random_labels(glm::uvec3 size, uint32_t seed, uint32_t labels, bool balls,
                     ScalarType type = ScalarType::u16) {
    std::mt19937 random(seed);
    std::vector<uint16_t> values(size_t{size.x} * size.y * size.z, 0);
    if (!balls)
        for (uint16_t& v : values)
            v = static_cast<uint16_t>(random() % labels);
    for (uint32_t n = 0; balls && n < 20; ++n) {
        const glm::dvec3 center(random() % size.x, random() % size.y, random() % size.z);
        const double radius = 1.0 + random() % 6;
        const auto label = static_cast<uint16_t>(random() % labels);
        for (uint32_t z = 0; z < size.z; ++z)
            for (uint32_t y = 0; y < size.y; ++y)
                for (uint32_t x = 0; x < size.x; ++x)
                    if (glm::length(glm::dvec3(x, y, z) - center) < radius)
                        values[x + size.x * (y + size_t{size.y} * z)] = label;
    }
    return make_labels(
        size, [&](glm::uvec3 i) { return values[i.x + size.x * (i.y + size_t{size.y} * i.z)]; },
        type);
}

// Background becomes label 1, and the others follow: then labels fill the box.
Volume raised(const Volume& labels) {
    return make_labels(labels.size(), [&](glm::uvec3 i) { return labels.value(i) + 1.0; });
}

std::map<uint16_t, uint64_t> voxel_counts(const Volume& labels) {
    std::map<uint16_t, uint64_t> counts;
    const glm::uvec3 size = labels.size();
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x)
                ++counts[static_cast<uint16_t>(labels.value({x, y, z}))];
    counts.erase(0);
    return counts;
}

// The surface of every label is closed and oriented and has no edge in three triangles or more; the
// labels are those of the volume; what they enclose is positive, and adds up to the box where they
// fill it. Returns how many points labels touch themselves in.
uint64_t expect_sound(const Volume& labels, const Mesh& mesh, bool fill_the_box) {
    uint64_t touching = 0;
    double sum = 0.0;
    const std::map<uint16_t, uint64_t> counts = voxel_counts(labels);
    std::set<uint16_t> found_labels;
    for (size_t n = 0; n < mesh.triangles.size(); ++n) {
        EXPECT_GT(mesh.labels[n], mesh.outer_labels[n]);
        found_labels.insert(mesh.labels[n]);
        found_labels.insert(mesh.outer_labels[n]); // one may lie wholly within a higher one
    }
    for (const auto& [label, count] : counts) {
        EXPECT_TRUE(found_labels.count(label)) << label;
        const MeshTopology found = topology(surface_of_label(mesh, label));
        EXPECT_EQ(found.open_edges, 0u) << label;
        EXPECT_EQ(found.non_manifold_edges, 0u) << label;
        EXPECT_EQ(found.misoriented_edges, 0u) << label;
        EXPECT_EQ(found.duplicate_triangles, 0u) << label;
        EXPECT_EQ(found.degenerate_triangles, 0u) << label;
        EXPECT_GT(found.volume_mm3, 0.0) << label;
        touching += found.non_manifold_vertices;
        sum += found.volume_mm3;
    }
    if (fill_the_box) {
        const double box = kVoxel_mm3 * double(sample_count(labels.grid()));
        EXPECT_NEAR(sum / box, 1.0, 1e-6);
    }
    return touching;
}

TEST(NetCell, LinksEveryWallOnceThroughEachFace) {
    // Round a cell's edge lie two of its faces: a wall of one label goes on through both. So for
    // each label the walls form closed loops; of all cells of up to four labels.
    for (uint32_t n = 0; n < 65536; ++n) {
        std::array<uint16_t, 8> labels;
        for (size_t c = 0; c < 8; ++c)
            labels[c] = n >> (2 * c) & 3;
        const NetCell cell = net_cell(labels);
        for (uint16_t label = 0; label < 4; ++label)
            for (int f = 0; f < 6; ++f) {
                const NetFace& face = net_face(f);
                const int kind = cell.splits >> (2 * f) & 3;
                int walls = 0;
                for (size_t i = 0; i < 4; ++i)
                    walls += (labels[face.corners[i]] == label) !=
                             (labels[face.corners[(i + 1) % 4]] == label);
                ASSERT_TRUE(walls == 0 || walls == 2 || (walls == 4 && kind != 0)) << n;
                for (size_t i = 0; i < 4; ++i) { // linked walls meet in one vertex
                    const uint8_t a = face.edges[(i + 3) % 4], b = face.edges[i];
                    const bool both = (cell.crossed >> a & 1) && (cell.crossed >> b & 1);
                    const bool is_cut_off = kind == 1 ? i % 2 == 0 : kind == 2 && i % 2 == 1;
                    if (both && (kind == 0 || is_cut_off)) {
                        ASSERT_EQ(cell.vertex[a], cell.vertex[b]) << n;
                    }
                }
            }
        if (n % 4 != 0) // relabelled upwards in the same order: nothing changes
            continue;
        std::array<uint16_t, 8> higher = labels;
        for (uint16_t& label : higher)
            label = static_cast<uint16_t>(label * 1000 + 5);
        const NetCell other = net_cell(higher);
        ASSERT_EQ(other.vertex, cell.vertex);
        ASSERT_EQ(other.splits, cell.splits);
    }
}

TEST(NetCell, OfTwoLabelsIsThatOfTheTable) {
    for (uint32_t pattern = 0; pattern < 256; ++pattern)
        for (const auto& [low, high] : {std::pair<uint16_t, uint16_t>(0, 1), {3, 65535}}) {
            std::array<uint16_t, 8> labels;
            for (size_t c = 0; c < 8; ++c)
                labels[c] = pattern >> c & 1 ? high : low;
            const NetCell a = net_cell(labels);
            const NetCell& b = net_cell_of_two(static_cast<uint8_t>(pattern));
            ASSERT_EQ(a.crossed, b.crossed);
            ASSERT_EQ(a.vertices, b.vertices);
            ASSERT_EQ(a.vertex, b.vertex);
            ASSERT_EQ(a.splits, b.splits);
            // As many vertices as marching cubes has loops, if it joins what this joins.
            ASSERT_EQ(a.vertices, cell_loops(static_cast<uint8_t>(pattern), 0x3f).size());
        }
}

TEST(SurfaceNets, OneVoxelIsABox) {
    const Volume volume =
        make_labels({3, 3, 3}, [](glm::uvec3 i) { return i == glm::uvec3(1) ? 9.0 : 0.0; });
    const Mesh mesh = surface_nets(volume);
    EXPECT_EQ(mesh.positions.size(), 8u);
    EXPECT_EQ(mesh.triangles.size(), 12u);
    const MeshTopology found = topology(mesh);
    EXPECT_TRUE(found.closed && found.manifold && found.consistently_oriented);
    EXPECT_EQ(found.euler_number, 2);
    EXPECT_DOUBLE_EQ(found.volume_mm3, kVoxel_mm3);
    EXPECT_DOUBLE_EQ(found.area_mm2, 2 * (0.5 * 0.75 + 0.75 * 2.0 + 2.0 * 0.5));
    // Smoothed as far as it goes, it is still there: a quarter of its width at the least.
    for (const uint32_t passes : {1u, 10u, 200u}) {
        const double volume_mm3 =
            topology(surface_nets(volume, {.passes = passes, .bound = 0.375})).volume_mm3;
        EXPECT_GE(volume_mm3, kVoxel_mm3 / 64.0 * (1 - 1e-6));
        EXPECT_LT(volume_mm3, kVoxel_mm3);
    }
}

TEST(SurfaceNets, LabelsThatFillTheBoxAddUpToIt) {
    uint64_t touching = 0;
    uint32_t seed = 1;
    for (const glm::uvec3 size :
         {glm::uvec3(5, 5, 5), glm::uvec3(1, 7, 3), glm::uvec3(18, 3, 17), glm::uvec3(11, 13, 36)})
        for (const uint32_t labels : {2u, 3u, 5u, 40u})
            for (const bool balls : {false, true})
                for (const uint32_t passes : {0u, 4u}) {
                    const Volume volume = random_labels(size, seed++, labels, balls);
                    const Mesh mesh = surface_nets(volume, {.passes = passes});
                    touching += expect_sound(volume, mesh, false);
                    const Volume full = raised(volume);
                    touching += expect_sound(full, surface_nets(full, {.passes = passes}), true);
                    if (HasFailure()) {
                        ADD_FAILURE() << size.x << "x" << size.y << "x" << size.z << ", " << labels
                                      << " labels, balls " << balls << ", passes " << passes;
                        return;
                    }
                }
    std::printf("labels touch themselves in %d points\n", static_cast<int>(touching));
}

TEST(SurfaceNets, TwoLabelsNeverTouchThemselves) {
    for (uint32_t seed = 1; seed < 200; ++seed) {
        const Volume volume = random_labels({5, 5, 5}, seed, 2, false);
        const Mesh mesh = surface_nets(volume, {.passes = seed % 2});
        EXPECT_EQ(expect_sound(volume, mesh, false), 0u) << seed;
        EXPECT_TRUE(topology(mesh).manifold);
        EXPECT_EQ(topology(weld(mesh)).non_manifold_edges, 0u) << seed; // nor by position
    }
}

// Walls are the faces of voxels if no face is split and no cell has two vertices.
TEST(SurfaceNets, UnsmoothedVolumesAreThoseOfTheVoxels) {
    const Volume volume = make_labels({20, 16, 8}, [](glm::uvec3 i) {
        return i.x < 7 ? 2.0 : i.y < 5 ? 300.0 : i.z < 3 ? 0.0 : 4.0;
    });
    const std::map<uint16_t, uint64_t> counts = voxel_counts(volume);
    const std::vector<LabelVolume> volumes = label_volumes(surface_nets(volume));
    const std::vector<LabelVolume> twin = surface_nets_volumes_fp64(volume);
    ASSERT_EQ(volumes.size(), counts.size());
    ASSERT_EQ(twin.size(), counts.size());
    for (size_t n = 0; n < volumes.size(); ++n) {
        const double expected = kVoxel_mm3 * double(counts.at(volumes[n].label));
        // Half samples times spacings of few bits are exact, and so are their products.
        EXPECT_NEAR(volumes[n].volume_mm3, expected, 1e-9 * expected);
        EXPECT_DOUBLE_EQ(twin[n].volume_mm3, expected);
    }
}

TEST(SurfaceNets, SmoothedVolumesEqualTheirTwinInDouble) {
    const Volume volume = random_labels({30, 30, 20}, 5, 9, true);
    const SurfaceNetsOptions options{.passes = 10};
    const std::vector<LabelVolume> found = label_volumes(surface_nets(volume, options));
    const std::vector<LabelVolume> twin = surface_nets_volumes_fp64(volume, options);
    ASSERT_EQ(found.size(), twin.size());
    for (size_t n = 0; n < found.size(); ++n) {
        EXPECT_EQ(found[n].label, twin[n].label);
        // Offsets below 1 are rounded 20 times, positions below 64 mm once: some 1e-5 mm of each
        // face of a voxel, of which none has more than 6 of 1.5 mm^2.
        const double voxels = double(voxel_counts(volume).at(found[n].label));
        EXPECT_NEAR(found[n].volume_mm3, twin[n].volume_mm3, 1e-5 * 9.0 * voxels);
        EXPECT_NE(found[n].volume_mm3, twin[n].volume_mm3); // it is another computation
    }
}

TEST(SurfaceNets, SmoothingBringsABallNearerToItsSphere) {
    const glm::dvec3 center(15.2, 14.9, 15.1);
    const auto inside = [&](glm::uvec3 i) {
        return glm::length(glm::dvec3(i) - center) < 10.0 ? 1.0 : 0.0;
    };
    const Volume volume =
        make_volume(make_grid(glm::uvec3(32), glm::dvec3(1.0)), ScalarType::u8, inside);
    const synthetic::Field sphere = synthetic::sphere_distance(center, 10.0);
    const Mesh plain = surface_nets(volume), smooth = surface_nets(volume, {.passes = 20});
    const FieldDistance before = distance_to_field(plain, sphere, 0.0, {.samples = 20000});
    const FieldDistance after = distance_to_field(smooth, sphere, 0.0, {.samples = 20000});
    EXPECT_LT(after.surface.rms_mm, 0.5 * before.surface.rms_mm);
    EXPECT_LT(after.surface.normal_rms_deg, 0.3 * before.surface.normal_rms_deg);
    EXPECT_NEAR(topology(smooth).volume_mm3 / topology(plain).volume_mm3, 1.0, 0.02);
    for (size_t v = 0; v < plain.positions.size(); ++v)
        for (int axis = 0; axis < 3; ++axis) // floats near 32
            ASSERT_LE(std::abs(smooth.positions[v][axis] - plain.positions[v][axis]),
                      0.375f + 4e-6f);
    EXPECT_EQ(smooth.triangles.size(), plain.triangles.size());
}

// A round leaves of one eigenvalue k of the mean over neighbours (1 - 0.6 k)^5 (1 + 3 k), three
// passes (1 - 0.5 k)^3 (1 + 0.53 k)^3. Stairs of eight samples along one axis have k = 0.15: 0.91
// and 1.00. A ball of radius r keeps its radius but for 5.4 k^2 with k = 1 / (2 r^2): below 1e-3.
TEST(SurfaceNets, AStrongRoundFlattensStairsAndKeepsVolume) {
    for (const double radius : {6.0, 10.0, 13.0}) {
        const glm::dvec3 center(15.2, 14.9, 15.1);
        const Volume volume =
            make_volume(make_grid(glm::uvec3(32), glm::dvec3(1.0)), ScalarType::u8,
                        [&](glm::uvec3 i) { return glm::length(glm::dvec3(i) - center) < radius; });
        const synthetic::Field sphere = synthetic::sphere_distance(center, radius);
        const Mesh plain = surface_nets(volume);
        const Mesh passes = surface_nets(volume, {.passes = 3, .bound = 0.49});
        const Mesh round = surface_nets(volume, {.rounds = 1, .bound = 0.49});
        const FieldDistance three = distance_to_field(passes, sphere, 0.0, {.samples = 20000});
        const FieldDistance one = distance_to_field(round, sphere, 0.0, {.samples = 20000});
        EXPECT_LT(one.surface.rms_mm, three.surface.rms_mm);
        EXPECT_LT(one.surface.normal_rms_deg, 0.7 * three.surface.normal_rms_deg);
        // The bound holds back what steps over a corner of stairs, by less than a percent.
        EXPECT_NEAR(topology(round).volume_mm3 / topology(plain).volume_mm3, 1.0, 0.01);
    }
}

TEST(SurfaceNets, AreTheSameOnAnyNumberOfThreadsAndForEveryType) {
    const Volume volume = random_labels({40, 37, 70}, 8, 6, true, ScalarType::u16);
    const SurfaceNetsOptions options{.passes = 3};
    const Mesh many = surface_nets(volume, options);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    for (const ScalarType type : {ScalarType::u16, ScalarType::u8, ScalarType::f32}) {
        const Mesh mesh = surface_nets(random_labels({40, 37, 70}, 8, 6, true, type), options);
        EXPECT_EQ(mesh.positions, many.positions);
        EXPECT_EQ(mesh.triangles, many.triangles);
        EXPECT_EQ(mesh.labels, many.labels);
        EXPECT_EQ(mesh.outer_labels, many.outer_labels);
    }
}

TEST(SurfaceNets, LieWhereTheGridIs) {
    const Volume volume = make_labels({2, 2, 2}, [](glm::uvec3) { return 1.0; });
    const Mesh mesh = surface_nets(volume);
    glm::dvec3 low(1e9), high(-1e9);
    for (const glm::vec3 p : mesh.positions) {
        const glm::dvec3 world(mesh.world_from_mesh * glm::dvec4(glm::dvec3(p), 1.0));
        low = glm::min(low, world);
        high = glm::max(high, world);
    }
    EXPECT_EQ(low, glm::dvec3(-5, 7, 100) - 0.5 * kSpacing);
    EXPECT_EQ(high, glm::dvec3(-5, 7, 100) + 1.5 * kSpacing);
}

TEST(SurfaceNets, OfNothingAreNothing) {
    const Mesh none = surface_nets(make_labels({4, 1, 9}, [](glm::uvec3) { return 0.0; }));
    EXPECT_TRUE(none.positions.empty() && none.triangles.empty());
    EXPECT_TRUE(label_volumes(none).empty());
    std::stop_source stop;
    stop.request_stop();
    const Volume ones = make_labels({9, 9, 9}, [](glm::uvec3) { return 1.0; });
    EXPECT_TRUE(surface_nets(ones, {.stop = stop.get_token()}).triangles.empty());
}

} // namespace
} // namespace palpate
