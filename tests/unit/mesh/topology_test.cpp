#include "engine/mesh/topology.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <numeric>
#include <random>
#include <set>

#include "engine/mesh/label_surfaces.h"
#include "engine/mesh/mesh_check.h"
#include "engine/mesh/open_edges.h"
#include "tests/support/meshes.h"

namespace palpate {
namespace {

// The same counts by ordered maps and repeated searches: slow, and obviously right.
struct BruteCounts {
    uint64_t open = 0, non_manifold = 0, misoriented = 0, split_vertices = 0, duplicates = 0;
    int64_t euler = 0;
    size_t components = 0;
};

BruteCounts brute_counts(const Mesh& mesh) {
    BruteCounts counts;
    std::map<std::pair<uint32_t, uint32_t>, std::pair<int, int>> edges; // ways run along
    std::set<std::vector<uint32_t>> seen;
    std::map<uint32_t, std::vector<glm::uvec3>> at_vertex;
    std::vector<glm::uvec3> triangles;
    for (const glm::uvec3 t : mesh.triangles)
        if (t.x != t.y && t.y != t.z && t.z != t.x)
            triangles.push_back(t);
    for (const glm::uvec3 t : triangles) {
        for (int i = 0; i < 3; ++i) {
            const uint32_t a = t[i], b = t[(i + 1) % 3];
            ++(a < b ? edges[{a, b}].first : edges[{b, a}].second);
            at_vertex[a].push_back(t);
        }
        std::vector<uint32_t> corners{t.x, t.y, t.z};
        std::sort(corners.begin(), corners.end());
        counts.duplicates += !seen.insert(corners).second;
    }
    for (const auto& [edge, ways] : edges) {
        counts.open += ways.first + ways.second == 1;
        counts.non_manifold += ways.first + ways.second > 2;
        counts.misoriented += ways.first + ways.second >= 2 && ways.first != ways.second;
    }
    // Flood: from one triangle of a list through those with `least` common vertices.
    const auto pieces = [](const std::vector<glm::uvec3>& list, int least) {
        std::vector<bool> done(list.size(), false);
        size_t count = 0;
        for (size_t start = 0; start < list.size(); ++start) {
            if (done[start])
                continue;
            ++count;
            std::vector<size_t> open{start};
            done[start] = true;
            while (!open.empty()) {
                const glm::uvec3 t = list[open.back()];
                open.pop_back();
                for (size_t n = 0; n < list.size(); ++n) {
                    int common = 0;
                    for (int i = 0; i < 3; ++i)
                        for (int j = 0; j < 3; ++j)
                            common += t[i] == list[n][j];
                    if (!done[n] && common >= least) {
                        done[n] = true;
                        open.push_back(n);
                    }
                }
            }
        }
        return count;
    };
    for (const auto& [v, list] : at_vertex)
        counts.split_vertices += pieces(list, 2) > 1;
    counts.components = pieces(triangles, 1);
    counts.euler = static_cast<int64_t>(at_vertex.size()) - static_cast<int64_t>(edges.size()) +
                   static_cast<int64_t>(triangles.size());
    return counts;
}

TEST(Topology, TetrahedronIsABall) {
    const MeshTopology found = topology(meshes::tetrahedron());
    EXPECT_TRUE(found.closed);
    EXPECT_TRUE(found.manifold);
    EXPECT_TRUE(found.consistently_oriented);
    EXPECT_EQ(found.euler_number, 2);
    ASSERT_EQ(found.components.size(), 1u);
    EXPECT_EQ(found.components[0].vertices, 4u);
    EXPECT_DOUBLE_EQ(found.volume_mm3, 1.0 / 6.0);
    EXPECT_DOUBLE_EQ(found.area_mm2, 1.5 + std::sqrt(3.0) / 2.0);
}

TEST(Topology, TorusHasEulerNumberZeroAndItsFacetedVolume) {
    const uint32_t m = 48, n = 24;
    const MeshTopology found = topology(meshes::torus(m, n, 10.0, 3.0));
    EXPECT_TRUE(found.closed && found.manifold && found.consistently_oriented);
    EXPECT_EQ(found.euler_number, 0);
    EXPECT_EQ(found.triangles, 2u * m * n);
    // The torus is faceted: the tube's polygon has its area times sin(2 pi/n)/(2 pi/n), and the way
    // round is shorter by sin(2 pi/m)/(2 pi/m); quads are planar, so triangles add nothing.
    // Vertices are floats: 2^-24 of a radius each way.
    const auto shrunk = [](double count) {
        const double a = 2.0 * std::numbers::pi / count;
        return std::sin(a) / a;
    };
    const double pi = std::numbers::pi;
    EXPECT_NEAR(found.volume_mm3, 2.0 * pi * pi * 10.0 * 9.0 * shrunk(m) * shrunk(n), 1e-3);
}

TEST(Topology, ComponentsCarryTheirOwnFigures) {
    const Mesh mesh = meshes::beside(
        meshes::turned_over(meshes::ball(2.0, 2)),
        meshes::beside(meshes::torus(12, 8, 30.0, 3.0), meshes::tetrahedron({100, 0, 0})));
    const MeshTopology found = topology(mesh);
    ASSERT_EQ(found.components.size(), 3u);
    EXPECT_EQ(found.components[0].euler_number, 2);
    EXPECT_LT(found.components[0].volume_mm3, 0.0); // a hollow
    EXPECT_EQ(found.components[1].euler_number, 0);
    EXPECT_EQ(found.components[2].euler_number, 2);
    // 100 mm from the first position, products are below 1e3: 2^-52 of them, a few times.
    EXPECT_NEAR(found.components[2].volume_mm3, 1.0 / 6.0, 1e-12);
    EXPECT_EQ(found.euler_number, 4);
    EXPECT_EQ(found.misoriented_edges, 0u);
}

TEST(Topology, FaultsAreCounted) {
    Mesh open = meshes::tetrahedron();
    open.triangles.pop_back();
    EXPECT_EQ(topology(open).open_edges, 3u);
    EXPECT_FALSE(topology(open).closed);
    EXPECT_EQ(topology(open).euler_number, 1);

    Mesh turned = meshes::tetrahedron();
    std::swap(turned.triangles[3].y, turned.triangles[3].z);
    EXPECT_EQ(topology(turned).misoriented_edges, 3u);
    EXPECT_TRUE(topology(turned).closed);
    EXPECT_FALSE(topology(turned).consistently_oriented);

    Mesh doubled = meshes::tetrahedron();
    doubled.triangles.push_back({1, 3, 0}); // the second triangle, turned about
    EXPECT_EQ(topology(doubled).duplicate_triangles, 1u);
    EXPECT_EQ(topology(doubled).non_manifold_edges, 3u);
    EXPECT_FALSE(topology(doubled).manifold);

    Mesh touching = meshes::beside(meshes::tetrahedron(), meshes::tetrahedron({5, 0, 0}));
    for (glm::uvec3& t : touching.triangles)
        for (int i = 0; i < 3; ++i)
            t[i] = t[i] == 4 ? 0 : t[i];
    EXPECT_EQ(topology(touching).non_manifold_vertices, 1u);
    EXPECT_EQ(topology(touching).non_manifold_edges, 0u);
    EXPECT_EQ(topology(touching).components.size(), 1u);
    EXPECT_EQ(topology(touching).euler_number, 3);
    EXPECT_FALSE(topology(touching).manifold);

    Mesh flat = meshes::tetrahedron();
    flat.positions.push_back({0.25f, 0.5f, 0.25f});
    flat.positions.push_back({0.5f, 0.0f, 0.0f});
    flat.triangles.push_back({0, 1, 5}); // in one line
    flat.triangles.push_back({4, 4, 1});
    EXPECT_EQ(topology(flat).zero_area_triangles, 1u);
    EXPECT_EQ(topology(flat).degenerate_triangles, 1u);
}

TEST(Topology, AnEmptyMeshIsClosed) {
    const MeshTopology found = topology(Mesh{});
    EXPECT_TRUE(found.closed && found.manifold && found.consistently_oriented);
    EXPECT_EQ(found.triangles, 0u);
    EXPECT_TRUE(found.components.empty());
}

TEST(Topology, EqualsBruteForceOnRandomTriangles) {
    std::mt19937 random(1);
    for (int round = 0; round < 400; ++round) {
        const uint32_t vertices = 3 + random() % 12;
        Mesh mesh;
        for (uint32_t v = 0; v < vertices; ++v)
            mesh.positions.emplace_back(random() % 4, random() % 4, random() % 4);
        for (uint32_t n = random() % 30; n > 0; --n)
            mesh.triangles.emplace_back(random() % vertices, random() % vertices,
                                        random() % vertices);
        const BruteCounts expected = brute_counts(mesh);
        const MeshTopology found = topology(mesh);
        ASSERT_EQ(found.open_edges, expected.open) << round;
        ASSERT_EQ(count_open_edges(mesh), expected.open) << round;
        ASSERT_EQ(found.non_manifold_edges, expected.non_manifold) << round;
        ASSERT_EQ(found.misoriented_edges, expected.misoriented) << round;
        ASSERT_EQ(found.non_manifold_vertices, expected.split_vertices) << round;
        ASSERT_EQ(found.duplicate_triangles, expected.duplicates) << round;
        ASSERT_EQ(found.euler_number, expected.euler) << round;
        ASSERT_EQ(found.components.size(), expected.components) << round;
    }
}

// Labels of samples by chance; between two samples of different labels a wall of two triangles,
// once, counter-clockwise seen from the lower label.
Mesh boxes_of_labels(std::mt19937& random, glm::ivec3 size, uint64_t& labelled) {
    Mesh mesh;
    std::vector<uint16_t> labels;
    for (int n = size.x * size.y * size.z; n > 0; --n)
        labels.push_back(static_cast<uint16_t>(random() % 4));
    labelled = static_cast<uint64_t>(
        std::count_if(labels.begin(), labels.end(), [](uint16_t label) { return label > 0; }));
    const auto label_at = [&](glm::ivec3 at) {
        const bool inside =
            glm::all(glm::greaterThanEqual(at, glm::ivec3(0))) && glm::all(glm::lessThan(at, size));
        return inside ? labels[static_cast<size_t>(at.x + size.x * (at.y + size.y * at.z))]
                      : uint16_t{0};
    };
    const auto vertex = [&](glm::ivec3 at) {
        return static_cast<uint32_t>(at.x + (size.x + 1) * (at.y + (size.y + 1) * at.z));
    };
    for (int z = 0; z <= size.z; ++z)
        for (int y = 0; y <= size.y; ++y)
            for (int x = 0; x <= size.x; ++x)
                mesh.positions.emplace_back(x + 100, y, z);
    for (int axis = 0; axis < 3; ++axis)
        for (int z = 0; z <= size.z; ++z)
            for (int y = 0; y <= size.y; ++y)
                for (int x = 0; x <= size.x; ++x) {
                    const glm::ivec3 here(x, y, z);
                    glm::ivec3 along(0), u(0), v(0);
                    along[axis] = u[(axis + 1) % 3] = v[(axis + 2) % 3] = 1;
                    const uint16_t below = label_at(here - along), above = label_at(here);
                    if (below == above || glm::any(glm::greaterThan(here + u + v, size)))
                        continue;
                    glm::uvec4 q(vertex(here), vertex(here + u), vertex(here + u + v),
                                 vertex(here + v)); // seen from above it is counter-clockwise
                    if (above > below)
                        std::swap(q.y, q.w);
                    for (const glm::uvec3 t : {glm::uvec3(q.x, q.y, q.z), {q.x, q.z, q.w}}) {
                        mesh.triangles.push_back(t);
                        mesh.labels.push_back(std::max(above, below));
                        mesh.outer_labels.push_back(std::min(above, below));
                    }
                }
    return mesh;
}

// The same mesh with positions and triangles in another order.
Mesh shuffled(const Mesh& mesh, std::mt19937& random) {
    std::vector<uint32_t> order(mesh.positions.size()), place(mesh.positions.size());
    std::iota(order.begin(), order.end(), 0u);
    std::shuffle(order.begin(), order.end(), random);
    Mesh out{.world_from_mesh = mesh.world_from_mesh};
    for (uint32_t v = 0; v < order.size(); ++v) {
        place[order[v]] = v;
        out.positions.push_back(mesh.positions[order[v]]);
    }
    std::vector<uint32_t> triangles(mesh.triangles.size());
    std::iota(triangles.begin(), triangles.end(), 0u);
    std::shuffle(triangles.begin(), triangles.end(), random);
    for (const uint32_t n : triangles) {
        const glm::uvec3 t = mesh.triangles[n];
        out.triangles.emplace_back(place[t.x], place[t.y], place[t.z]);
        if (!mesh.labels.empty())
            out.labels.push_back(mesh.labels[n]);
        if (!mesh.outer_labels.empty())
            out.outer_labels.push_back(mesh.outer_labels[n]);
    }
    return out;
}

// Whole coordinates: a unit cube for each labelled sample, whatever the order.
TEST(Topology, SharedWallsEncloseWhatTheirLabelsDoInAnyOrder) {
    std::mt19937 random(7);
    for (int round = 0; round < 20; ++round) {
        uint64_t labelled = 0;
        const Mesh mesh = boxes_of_labels(random, {5, 4, 3}, labelled);
        double sum = 0.0;
        for_each_label(mesh, [&](uint16_t label, const Mesh& surface) {
            sum += label > 0 ? topology(surface).volume_mm3 : 0.0;
        });
        EXPECT_NEAR(sum, static_cast<double>(labelled), 1e-9);
        for (int order = 0; order < 4; ++order)
            EXPECT_NEAR(topology(shuffled(mesh, random)).volume_mm3, static_cast<double>(labelled),
                        1e-9)
                << round;
    }
}

// Its volume is not defined, but is the same in any order.
TEST(Topology, FiguresOfAnOpenMeshDoNotDependOnItsOrder) {
    std::mt19937 random(8);
    Mesh open = meshes::tetrahedron();
    open.triangles.pop_back();
    for (glm::vec3& position : open.positions)
        position += glm::vec3(50, 60, 70);
    const double volume = topology(open).volume_mm3;
    for (int order = 0; order < 10; ++order)
        EXPECT_NEAR(topology(shuffled(open, random)).volume_mm3, volume, 1e-9);
}

TEST(Topology, WorldMayBeFarAndMirrored) {
    Mesh mesh = meshes::ball(1.0, 3);
    const MeshTopology here = topology(mesh);
    glm::dmat4 world = glm::translate(glm::dmat4(1.0), glm::dvec3(1e7, -1e7, 1e7));
    mesh.world_from_mesh = glm::scale(world, glm::dvec3(-2.0, 1.0, 3.0));
    const MeshTopology there = topology(mesh);
    // Outward stays outward: mesh space says which side is which.
    // A sum of 512 terms of one sign is rounded by at most 512 times 2^-52 of itself.
    const double rounding = 512 * 0x1p-52;
    EXPECT_NEAR(there.volume_mm3, 6.0 * here.volume_mm3, rounding * there.volume_mm3);
    mesh.world_from_mesh = glm::scale(world, glm::dvec3(-2.0));
    EXPECT_NEAR(topology(mesh).area_mm2, 4.0 * here.area_mm2, rounding * 4.0 * here.area_mm2);
}

TEST(Topology, SubdividedBallTendsToTheSphere) {
    double last_error = 0.0;
    for (const int levels : {2, 3, 4, 5}) {
        const double volume = topology(meshes::ball(10.0, levels)).volume_mm3;
        const double error = 1.0 - volume / (4.0 / 3.0 * std::numbers::pi * 1000.0);
        // A chord's sag is of second order, and halving edges quarters it.
        if (last_error > 0.0) {
            EXPECT_NEAR(last_error / error, 4.0, 0.5);
        }
        last_error = error;
    }
    EXPECT_LT(last_error, 2e-3);
}

TEST(Weld, JoinsEqualPositionsAndKeepsTheOrder) {
    const Mesh ball = meshes::ball(3.0, 2);
    Mesh soup{.world_from_mesh = glm::scale(glm::dmat4(1.0), glm::dvec3(2.0))};
    for (const glm::uvec3 t : ball.triangles) {
        const auto first = static_cast<uint32_t>(soup.positions.size());
        for (int i = 0; i < 3; ++i)
            soup.positions.push_back(ball.positions[t[i]] * glm::vec3(1.0f, 1.0f, 1.0f));
        soup.triangles.emplace_back(first, first + 1, first + 2);
        soup.labels.push_back(static_cast<uint16_t>(first));
    }
    soup.positions[0].x += 0.0f;
    EXPECT_EQ(topology(soup).open_edges, 3 * ball.triangles.size());
    const Mesh welded = weld(soup);
    EXPECT_EQ(welded.positions.size(), ball.positions.size());
    EXPECT_EQ(welded.labels, soup.labels);
    EXPECT_EQ(welded.world_from_mesh, soup.world_from_mesh);
    const MeshTopology found = topology(welded);
    EXPECT_TRUE(found.closed && found.manifold && found.consistently_oriented);
    for (size_t n = 0; n < soup.triangles.size(); ++n)
        for (int i = 0; i < 3; ++i)
            ASSERT_EQ(welded.positions[welded.triangles[n][i]],
                      soup.positions[soup.triangles[n][i]]);
    Mesh signs{.positions = {{0.0f, 1.0f, 0.0f}, {-0.0f, 1.0f, -0.0f}}};
    EXPECT_EQ(weld(signs).positions.size(), 1u);
}

TEST(VertexNormals, OfABallPointOutward) {
    const Mesh ball = meshes::ball(5.0, 4);
    const std::vector<glm::vec3> normals = vertex_normals(ball);
    // The mean of facets about a vertex of a symmetric fan is exact; others are off by less than
    // the facets themselves, whose tilt is half an edge over the radius: 0.5 * pi/2 / 16 = 0.05.
    for (size_t v = 0; v < normals.size(); ++v)
        ASSERT_GT(glm::dot(normals[v], ball.positions[v] / 5.0f), std::cos(0.05f));
}

TEST(SurfaceOfLabel, TakesWallsFromBothSides) {
    // Two tetrahedra share the face x + y + z = 1; it is there once, as the surface of label 2.
    Mesh mesh = meshes::tetrahedron();
    mesh.positions.push_back({1, 1, 1});
    mesh.labels = {1, 1, 1, 2};
    mesh.outer_labels = {0, 0, 0, 1};
    std::swap(mesh.triangles[3].y, mesh.triangles[3].z);
    for (const glm::uvec3 t : {glm::uvec3(1, 2, 4), glm::uvec3(2, 3, 4), glm::uvec3(3, 1, 4)}) {
        mesh.triangles.push_back(t);
        mesh.labels.push_back(2);
        mesh.outer_labels.push_back(0);
    }
    EXPECT_EQ(topology(mesh).non_manifold_edges, 3u);
    for (const uint16_t label : {1, 2}) {
        const Mesh surface = surface_of_label(mesh, label);
        const MeshTopology found = topology(surface);
        EXPECT_TRUE(found.closed && found.manifold && found.consistently_oriented) << label;
        EXPECT_EQ(surface.positions.size(), 4u);
        // The second has corners (1,0,0), (0,1,0), (0,0,1), (1,1,1): a regular one, side sqrt 2.
        EXPECT_NEAR(found.volume_mm3, label == 1 ? 1.0 / 6.0 : 1.0 / 3.0, 1e-15);
    }
    EXPECT_TRUE(surface_of_label(mesh, 3).triangles.empty());
}

// Triangles by chance, with positions that few, many or none of them use.
TEST(ForEachLabel, GivesWhatEachLabelHasByItself) {
    for (const bool has_outer : {false, true}) {
        std::mt19937 random(has_outer);
        const uint16_t known[] = {0, 1, 2, 7, 300, 65534, 65535};
        Mesh mesh{.world_from_mesh = glm::scale(glm::dmat4(1), glm::dvec3(2.0))};
        for (int i = 0; i < 60; ++i) {
            mesh.positions.emplace_back(random() % 9, random() % 9, random() % 9);
            mesh.normals.emplace_back(random() % 9, 0, i);
        }
        std::set<uint16_t> present;
        for (int i = 0; i < 200; ++i) {
            mesh.triangles.emplace_back(random() % 50, random() % 50, random() % 50);
            mesh.labels.push_back(known[1 + random() % 6]);
            present.insert(mesh.labels.back());
            if (has_outer) {
                mesh.outer_labels.push_back(known[random() % 7]);
                present.insert(mesh.outer_labels.back());
            }
        }
        std::vector<uint16_t> visited;
        for_each_label(mesh, [&](uint16_t label, const Mesh& surface) {
            visited.push_back(label);
            const Mesh expected = surface_of_label(mesh, label);
            EXPECT_EQ(surface.positions, expected.positions);
            EXPECT_EQ(surface.normals, expected.normals);
            EXPECT_EQ(surface.triangles, expected.triangles);
            EXPECT_EQ(surface.labels, expected.labels);
            EXPECT_TRUE(surface.outer_labels.empty());
            EXPECT_EQ(surface.world_from_mesh, expected.world_from_mesh);
        });
        EXPECT_EQ(visited, std::vector<uint16_t>(present.begin(), present.end()));
    }
    for_each_label(Mesh(), [](uint16_t, const Mesh&) { FAIL(); });
}

TEST(CheckMesh, NamesTheFirstFault) {
    const auto why = [](Mesh mesh) {
        const Result<void> whole = check_mesh(mesh);
        return whole ? "" : whole.error().message;
    };
    const Mesh good = meshes::tetrahedron();
    const auto with = [&](const auto& spoil) {
        Mesh mesh = good;
        spoil(mesh);
        return why(std::move(mesh));
    };
    EXPECT_EQ(why({}), "");
    EXPECT_EQ(why(good), "");
    EXPECT_EQ(with([](Mesh& m) { m.normals.resize(3); }),
              "a mesh: expected no normals or 4, found 3");
    EXPECT_EQ(with([](Mesh& m) { m.labels.resize(5); }),
              "a mesh: expected no labels or 4, found 5");
    EXPECT_EQ(with([](Mesh& m) { m.outer_labels.resize(1); }),
              "a mesh: expected no outer labels or 4, found 1");
    EXPECT_EQ(with([](Mesh& m) { m.positions[2].y = NAN; }),
              "a mesh: expected finite positions, found 0 nan 0 at vertex 2");
    EXPECT_EQ(with([](Mesh& m) { m.triangles[1].z = 4; }),
              "a mesh: expected triangles of its 4 vertices, found 0 1 4 at triangle 1");
}

} // namespace
} // namespace palpate
