#include "engine/surface/tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <random>

#include "engine/mesh/distance.h"
#include "engine/mesh/topology.h"
#include "engine/surface/cell_tables.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "engine/volume/synthetic.h"

namespace palpate {
namespace {

Volume tracked_labels(glm::uvec3 size, const std::function<double(glm::uvec3)>& value,
                      ScalarType type = ScalarType::u8, glm::dvec3 spacing = {0.5, 0.5, 3.0}) {
    return make_volume(make_grid(size, spacing, {10, 20, 30}), type, value);
}

Volume random_labels(glm::uvec3 size, uint32_t seed, uint32_t labels, ScalarType type) {
    std::mt19937 random(seed);
    std::vector<uint8_t> values(size_t{size.x} * size.y * size.z);
    for (uint8_t& v : values)
        v = static_cast<uint8_t>(random() % labels);
    return tracked_labels(
        size, [&](glm::uvec3 i) { return values[i.x + size.x * (i.y + size_t{size.y} * i.z)]; },
        type);
}

uint8_t brute_case(const Volume& volume, glm::ivec3 low, uint16_t label) {
    int found = 0;
    for (int c = 0; c < 8; ++c) {
        const glm::ivec3 i = low + glm::ivec3(c & 1, c >> 1 & 1, c >> 2 & 1);
        bool is_within = true;
        for (int axis = 0; axis < 3; ++axis)
            is_within = is_within && i[axis] >= 0 && i[axis] < int(volume.size()[axis]);
        found |= (is_within && volume.value(glm::uvec3(i)) == float(label)) << c;
    }
    return static_cast<uint8_t>(found);
}

template <class Visit>
void for_each_cell(glm::uvec3 count, const Visit& visit) {
    for (uint32_t z = 0; z < count.z; ++z)
        for (uint32_t y = 0; y < count.y; ++y)
            for (uint32_t x = 0; x < count.x; ++x)
                visit(glm::uvec3(x, y, z));
}

// C and the coverage arrays by looking at every cell.
void expect_cells(const SurfaceTracker& tracker, const Volume& volume, uint16_t label,
                  bool closed) {
    const glm::uvec3 count = tracker.cell_count();
    for (uint32_t z = 0; z < count.z; ++z)
        for (uint32_t y = 0; y < count.y; ++y) {
            uint32_t first = count.x, end = 0;
            for (uint32_t x = 0; x < count.x; ++x) {
                const uint8_t found =
                    brute_case(volume, glm::ivec3(x, y, z) - (closed ? 1 : 0), label);
                const bool is_crossed = found != 0 && found != 255;
                ASSERT_EQ(tracker.cell({x, y, z}), is_crossed ? found : 0)
                    << x << " " << y << " " << z;
                if (is_crossed) {
                    first = std::min(first, x);
                    end = x + 1;
                }
            }
            ASSERT_EQ(tracker.first(y, z), first);
            ASSERT_EQ(tracker.end(y, z), end);
        }
}

// The same triangles cell by cell, each with corners of its own, and welded: no tracking, coverage
// or caches.
Mesh brute_mesh(const Volume& volume, uint16_t label, bool closed) {
    Mesh soup{.world_from_mesh = world_from_mesh(volume.grid())};
    const int border = closed ? 1 : 0;
    for_each_cell(volume.size() - 1u + 2u * unsigned(border), [&](glm::uvec3 at) {
        const glm::ivec3 low = glm::ivec3(at) - border;
        const uint8_t c = brute_case(volume, low, label);
        for (size_t i = 0; i < 3u * classic_table().triangle_count[c]; ++i) {
            const CellEdge edge = cell_edge(classic_table().edges[c][i]);
            glm::dvec3 p(low + glm::ivec3(edge.corner & 1, edge.corner >> 1 & 1, edge.corner >> 2));
            p[edge.axis] += 0.5;
            soup.positions.emplace_back(p * spacing_mm(volume.grid()));
            if (i % 3 == 2) {
                const auto n = static_cast<uint32_t>(soup.positions.size());
                soup.triangles.emplace_back(n - 3, n - 2, n - 1);
            }
        }
    });
    return weld(soup);
}

void expect_same_mesh(const Mesh& found, const Mesh& expected) {
    ASSERT_EQ(found.positions.size(), expected.positions.size());
    ASSERT_EQ(found.triangles.size(), expected.triangles.size());
    EXPECT_EQ(found.world_from_mesh, expected.world_from_mesh);
    for (size_t n = 0; n < found.triangles.size(); ++n) // both go through cells x fastest
        for (int i = 0; i < 3; ++i)
            ASSERT_EQ(found.positions[found.triangles[n][i]],
                      expected.positions[expected.triangles[n][i]]);
}

TEST(SurfaceTracker, FindsEveryCellAndTriangleOfRandomLabels) {
    uint32_t seed = 1;
    for (const glm::uvec3 size :
         {glm::uvec3(9, 8, 7), glm::uvec3(2, 2, 2), glm::uvec3(35, 3, 34), glm::uvec3(66, 5, 3)})
        for (const ScalarType type : {ScalarType::u8, ScalarType::u16, ScalarType::f32})
            for (const bool closed : {false, true}) {
                const Volume volume = random_labels(size, seed++, 3, type);
                SurfaceTracker tracker(volume, 2, {.closed = closed});
                tracker.find_all();
                expect_cells(tracker, volume, 2, closed);
                const Mesh mesh = tracker.triangulate();
                expect_same_mesh(mesh, brute_mesh(volume, 2, closed));
                if (!closed)
                    continue;
                const MeshTopology found = topology(mesh);
                EXPECT_TRUE(found.closed && found.manifold && found.consistently_oriented);
                EXPECT_EQ(found.duplicate_triangles + found.zero_area_triangles, 0u);
            }
}

TEST(SurfaceTracker, CellsAtXZeroAreNotLost) {
    // As printed, X+ = 0 for a surface that crosses a line at x = 0 alone would mean none.
    const Volume volume = tracked_labels(
        {5, 4, 4}, [](glm::uvec3 i) { return i == glm::uvec3(0, 1, 1) ? 1.0 : 0.0; });
    SurfaceTracker tracker(volume, 1);
    tracker.find_all();
    EXPECT_EQ(tracker.end(1, 1), 1u);
    EXPECT_EQ(tracker.triangulate().triangles.size(), 4u); // half an octahedron
}

TEST(SurfaceTracker, ASeedFindsItsOwnSurfaceAlone) {
    const Volume volume = tracked_labels({40, 20, 20}, [](glm::uvec3 i) {
        const glm::dvec3 p(i);
        return glm::length(p - glm::dvec3(10, 10, 10)) < 6 ||
                       glm::length(p - glm::dvec3(30, 10, 10)) < 4
                   ? 7.0
                   : 0.0;
    });
    SurfaceTracker tracker(volume, 7);
    EXPECT_FALSE(tracker.track({0, 0, 0}));    // outside
    EXPECT_FALSE(tracker.track({10, 10, 10})); // inside
    EXPECT_TRUE(tracker.triangulate().triangles.empty());
    EXPECT_TRUE(tracker.track({33, 10, 10}));
    const MeshTopology one = topology(tracker.triangulate());
    EXPECT_EQ(one.components.size(), 1u);
    EXPECT_EQ(one.euler_number, 2);
    EXPECT_TRUE(tracker.track({33, 10, 10})); // nothing new
    EXPECT_EQ(topology(tracker.triangulate()).triangles, one.triangles);
    EXPECT_TRUE(tracker.track({15, 10, 10}));
    const Mesh both = tracker.triangulate();
    SurfaceTracker all(volume, 7);
    all.find_all();
    EXPECT_EQ(both.positions, all.triangulate().positions);
    EXPECT_EQ(topology(both).components.size(), 2u);
    EXPECT_EQ(both.labels, std::vector<uint16_t>(both.triangles.size(), 7));
}

TEST(SurfaceTracker, SolidsHaveTheirEulerNumberAndVolume) {
    const Grid grid = make_grid({48, 48, 32}, {1, 1, 1.5}, {-23.5, -23.5, -23.25});
    const synthetic::Field torus = synthetic::torus({}, 14.0, 6.0);
    const Volume volume = make_volume(grid, ScalarType::u8, [&](glm::uvec3 i) {
        return torus.value(world_point(grid, glm::dvec3(i))) > 0.0 ? 1.0 : 0.0;
    });
    SurfaceTracker tracker(volume, 1);
    tracker.find_all();
    const Mesh mesh = tracker.triangulate();
    const MeshTopology found = topology(mesh);
    EXPECT_TRUE(found.closed && found.manifold && found.consistently_oriented);
    EXPECT_EQ(found.euler_number, 0);
    // Midway vertices cut corners of the voxels: of volume within half a voxel of the surface.
    const double pi = std::numbers::pi;
    EXPECT_NEAR(found.volume_mm3, 2 * pi * pi * 14 * 36, 0.5 * 4 * pi * pi * 14 * 6);
    const FieldDistance distance = distance_to_field(mesh, torus, 0.0, {.samples = 1000});
    // A crossed edge is at most 1.5 mm, its middle at most half of that from the surface.
    EXPECT_LE(distance.vertex_largest_mm, 0.75);
}

TEST(SurfaceTracker, LocalUpdatesEqualASearchAnew) {
    const glm::uvec3 size(37, 22, 19);
    std::mt19937 random(9);
    for (const bool closed : {false, true}) {
        Volume volume = random_labels(size, 3, 2, ScalarType::u8);
        SurfaceTracker tracker(volume, 1, {.closed = closed});
        tracker.find_all();
        for (int round = 0; round < 60; ++round) {
            const auto any = [&] {
                const uint32_t x = random() % size.x, y = random() % size.y;
                return glm::uvec3(x, y, random() % size.z);
            };
            const glm::uvec3 low = any(), high = glm::min(low + any() / 4u, size - 1u);
            const uint32_t kind = random() % 3; // noise, erase, fill
            VolumeEdit edit(volume);
            for_each_cell(high - low + 1u, [&](glm::uvec3 i) {
                edit.set(low + i, kind == 0 ? random() % 2 : kind - 1);
            });
            volume = edit.commit();
            tracker.update(volume, low, high);
            expect_cells(tracker, volume, 1, closed);
            if (HasFatalFailure())
                return;
        }
        SurfaceTracker anew(volume, 1, {.closed = closed});
        anew.find_all();
        const Mesh a = tracker.triangulate(), b = anew.triangulate();
        EXPECT_EQ(a.positions, b.positions);
        EXPECT_EQ(a.triangles, b.triangles);
        EXPECT_EQ(a.normals, b.normals);
    }
}

TEST(SurfaceTracker, AnUpdateFindsWholeSurfacesThatComeIntoSight) {
    const Volume before = tracked_labels({30, 20, 20}, [](glm::uvec3 i) {
        return glm::length(glm::dvec3(i) - glm::dvec3(20, 10, 10)) < 7 ? 1.0 : 0.0;
    });
    VolumeEdit edit(before);
    edit.set({13, 10, 10}, 1);
    const Volume after = edit.commit();
    SurfaceTracker tracker(before, 1); // has found nothing yet
    tracker.update(after, {13, 10, 10}, {13, 10, 10});
    SurfaceTracker all(after, 1);
    all.find_all();
    EXPECT_EQ(tracker.triangulate().positions, all.triangulate().positions);
}

TEST(SurfaceTracker, NormalsAreMeansOfTheTrianglesAboutAVertex) {
    const Volume volume = random_labels({8, 8, 8}, 11, 2, ScalarType::u8); // spacing 0.5, 0.5, 3
    SurfaceTracker tracker(volume, 1, {.closed = true});
    tracker.find_all();
    const Mesh mesh = tracker.triangulate();
    std::vector<glm::dvec3> sums(mesh.positions.size(), glm::dvec3(0.0));
    for (const glm::uvec3 t : mesh.triangles) {
        const glm::dvec3 a(mesh.positions[t.x]), b(mesh.positions[t.y]), c(mesh.positions[t.z]);
        for (int i = 0; i < 3; ++i)
            sums[t[i]] += glm::normalize(glm::cross(b - a, c - a));
    }
    for (size_t v = 0; v < sums.size(); ++v)
        if (glm::length(sums[v]) > 1e-3) { // else they cancel, and rounding decides
            // Sums of a few unit floats, over at least 1e-3.
            ASSERT_LT(glm::length(glm::normalize(sums[v]) - glm::dvec3(mesh.normals[v])), 2e-3);
        }
}

TEST(SurfaceTracker, MayInterpolateAndTakeNormalsFromGradients) {
    const Grid grid = make_grid({40, 40, 20}, {1, 1, 2}, {-19.5, -19.5, -19});
    const synthetic::Field field = synthetic::gaussian({}, 8.0);
    const Volume grey = synthetic::sample(field, grid, ScalarType::f32);
    const float iso = 400.0f;
    const Volume labels = make_volume(grid, ScalarType::u8,
                                      [&](glm::uvec3 i) { return grey.value(i) >= iso ? 1 : 0; });
    SurfaceTracker plain(labels, 1);
    SurfaceTracker fine(labels, 1,
                        {.grey = grey, .iso = iso, .interpolate = true, .gradient_normals = true});
    plain.find_all();
    fine.find_all();
    const Mesh coarse = plain.triangulate(), mesh = fine.triangulate();
    EXPECT_EQ(coarse.triangles, mesh.triangles);
    const FieldDistance before = distance_to_field(coarse, field, iso, {.samples = 1000});
    const FieldDistance after = distance_to_field(mesh, field, iso, {.samples = 1000});
    // Linear interpolation over an edge of h <= 2 mm is off by at most h^2 max|f''| / 8 over the
    // gradient: with sigma 8 and radius 10.8, f'' <= 400 / 64 and |f'| = 400 * 10.8 / 64.
    const double bound = 4.0 / 8.0 * (400.0 / 64.0) / (400.0 * 10.8 / 64.0);
    EXPECT_LE(after.vertex_largest_mm, bound);
    EXPECT_GT(before.vertex_largest_mm, 10 * bound);
    // Central differences are off by h^2 |f'''| / 6: below 0.05 of the gradient here.
    EXPECT_LE(after.vertex_normal_max_deg, glm::degrees(0.05));
    EXPECT_GT(before.vertex_normal_max_deg, 10.0);
    for (size_t v = 0; v < mesh.positions.size(); ++v)
        ASSERT_LE(glm::length(mesh.positions[v] - coarse.positions[v]), 1.0f);
    // Vertices stay midway where labels were edited and V does not cross iso.
    VolumeEdit edit(labels);
    edit.set({1, 1, 1}, 1);
    const Volume edited = edit.commit();
    fine.update(edited, {1, 1, 1}, {1, 1, 1});
    EXPECT_EQ(fine.triangulate().triangles.size(), mesh.triangles.size() + 8); // an octahedron
}

TEST(SurfaceTracker, ThinVolumesHaveNoCells) {
    for (const glm::uvec3 size : {glm::uvec3(1, 9, 9), glm::uvec3(9, 9, 1), glm::uvec3(1)}) {
        const Volume volume = tracked_labels(size, [](glm::uvec3) { return 1.0; });
        SurfaceTracker open(volume, 1), closed(volume, 1, {.closed = true});
        open.find_all();
        closed.find_all();
        EXPECT_TRUE(open.triangulate().triangles.empty());
        const MeshTopology found = topology(closed.triangulate());
        EXPECT_TRUE(found.closed && found.manifold);
        EXPECT_EQ(found.euler_number, 2);
    }
    SurfaceTracker none(tracked_labels({5, 5, 5}, [](glm::uvec3) { return 0.0; }), 1);
    none.find_all();
    EXPECT_TRUE(none.triangulate().triangles.empty());
}

TEST(TrackLabels, TakesEachLabelOnItsOwn) {
    const Volume volume = tracked_labels(
        {12, 6, 6}, [](glm::uvec3 i) { return i.x < 4   ? 3.0
                                              : i.x < 8 ? 300.0
                                                        : 0.0; },
        ScalarType::u16);
    const std::vector<Mesh> meshes = track_labels(volume, {.closed = true});
    ASSERT_EQ(meshes.size(), 2u);
    EXPECT_EQ(meshes[0].labels[0], 3);
    EXPECT_EQ(meshes[1].labels[0], 300);
    for (const Mesh& mesh : meshes) {
        EXPECT_TRUE(topology(mesh).closed);
        EXPECT_EQ(topology(mesh).euler_number, 2);
    }
}

} // namespace
} // namespace palpate
