// Cells over triangles: the same answers as without them, from a bounded number of looks.

#include <cmath>
#include <random>

#include "haptics/field/triangles.h"
#include "haptics/proxy/swept_mesh.h"
#include "tests/unit/haptics_proxy/run.h"

namespace palpate::touch {
namespace {

using glm::dvec3;

// A rough sheet about z = 0: squares of `edge_mm`, heights drawn up to half of `rough_mm` away.
std::shared_ptr<const Mesh> rough_sheet(uint32_t squares, float edge_mm, double rough_mm) {
    auto mesh = std::make_shared<Mesh>();
    std::mt19937_64 random(squares);
    const float middle = 0.5f * static_cast<float>(squares);
    for (uint32_t y = 0; y <= squares; ++y)
        for (uint32_t x = 0; x <= squares; ++x) {
            const double height = rough_mm * (double(random() >> 11) * 0x1p-53 - 0.5);
            mesh->positions.push_back({edge_mm * (float(x) - middle), edge_mm * (float(y) - middle),
                                       static_cast<float>(height)});
            mesh->normals.push_back({0, 0, 1});
        }
    for (uint32_t y = 0; y < squares; ++y)
        for (uint32_t x = 0; x < squares; ++x) {
            const uint32_t a = x + (squares + 1) * y, b = a + squares + 1;
            mesh->triangles.push_back({a, a + 1, b + 1});
            mesh->triangles.push_back({a, b + 1, b});
        }
    return mesh;
}

// Sheared and uneven cells with one cell a triangle, as a window's, and a mesh's own.
TEST(TriangleCells, GiveTheSameAnswersAsAllTriangles) {
    const auto mesh = rough_sheet(24, 0.25f, 0.6);
    const auto made = haptics::make_touch_mesh(mesh, 0.5);
    const haptics::TriangleSpan all{mesh->positions, mesh->normals, mesh->triangles, 0.05};
    const double per_mm = 1.0 / double{made->cell_mm};
    haptics::TriangleSpan own{mesh->positions, mesh->normals, made->triangles, 0.05};
    own.cells = {glm::dmat3(per_mm), -per_mm * dvec3(made->low_mm),
                 made->cells,        {},
                 made->cells - 1,    made->first};
    // Columns that lean, of 1.2 x 0.8 mm, and of all heights.
    const glm::dmat3 lean =
        glm::inverse(glm::dmat3({1.2, 0.0, 0.0}, {0.3, 0.8, 0.0}, {0.4, 0.2, 9.0}));
    haptics::TriangleCells columns{lean, dvec3(6, 5, 0.5), {12, 10, 1}, {}, {11, 9, 0}, {}};
    std::vector<std::vector<glm::uvec3>> lists(120);
    for (const glm::uvec3 t : mesh->triangles) {
        dvec3 low(1e9), high(-1e9);
        for (int k = 0; k < 3; ++k) {
            const dvec3 at = lean * dvec3(mesh->positions[t[k]]) + columns.offset;
            low = glm::min(low, at);
            high = glm::max(high, at);
        }
        const auto cell_of = [&](dvec3 p) {
            return glm::clamp(glm::ivec3(glm::floor(p)), columns.from, columns.to);
        };
        const glm::ivec3 from = cell_of(low), to = cell_of(high);
        for (int y = from.y; y <= to.y; ++y)
            for (int x = from.x; x <= to.x; ++x)
                lists[size_t(x + 12 * y)].push_back(t);
    }
    std::vector<glm::uvec3> sorted;
    std::vector<uint32_t> first{0};
    for (const auto& list : lists) {
        sorted.insert(sorted.end(), list.begin(), list.end());
        first.push_back(static_cast<uint32_t>(sorted.size()));
    }
    haptics::TriangleSpan leaning{mesh->positions, mesh->normals, sorted, 0.05};
    leaning.cells = columns;
    leaning.cells.first = first;

    std::mt19937_64 random(7);
    const auto unit = [&] { return double(random() >> 11) * 0x1p-53 - 0.5; };
    int near_found = 0, hits = 0;
    for (int n = 0; n < 4000; ++n) {
        const dvec3 p(7.0 * unit(), 7.0 * unit(), 3.0 * unit() * unit());
        const double length = std::pow(10.0, 8.0 * unit() - 3.0); // 1e-7 to 10 mm
        const dvec3 to = p + length * dvec3(unit(), unit(), unit());
        const double within = n % 2 ? INFINITY : std::abs(unit());
        const double behind = n % 3 ? 1e-5 : 0.0;
        const haptics::SurfacePoint near = nearest_point(all, p, within);
        const haptics::SurfacePoint hit = first_crossing(all, p, to, behind);
        near_found += near.found;
        hits += hit.found;
        for (const haptics::TriangleSpan* cells : {&own, &leaning}) {
            int64_t left = int64_t(mesh->triangles.size());
            haptics::TriangleSpan counted = *cells;
            counted.looks_left = &left;
            const haptics::SurfacePoint close = nearest_point(counted, p, within);
            ASSERT_EQ(close.found, near.found) << n;
            ASSERT_NEAR(close.distance, near.distance, 1e-12) << n;
            ASSERT_LE(glm::distance(close.point, near.point), 1e-6) << n;
            const haptics::SurfacePoint met = first_crossing(counted, p, to, behind);
            ASSERT_EQ(met.found, hit.found) << n;
            ASSERT_NEAR(met.distance, hit.distance, 1e-12) << n;
            if (length < 0.25 && near.found && near.distance < 0.1) {
                EXPECT_GT(left, int64_t(mesh->triangles.size() / 2)) << "few are looked at " << n;
            }
        }
    }
    EXPECT_GE(near_found, 2000);
    EXPECT_GE(hits, 150);
}

// Two hundred times as many triangles as a grain has faces of its own: a hand that slides, leaps
// and shakes on them is held in every tick, by at most as many looks as a tick has and those of the
// last sweep, across the sheet at most.
TEST(TriangleCells, BoundTheLooksOfATickOnADenseMesh) {
    Scene scene = make_scene(flat_plane(), {});
    const auto mesh = rough_sheet(240, 0.025f, 0.1);
    const auto made = haptics::make_touch_mesh(mesh, 0.5);
    scene.touch.touch_mesh = made;
    const haptics::TouchParameters parameters = settings(scene);
    const auto algorithm = haptics::find_algorithm("swept-mesh")->make();
    haptics::TickInput input{.dt_s = 1e-3, .scene = &scene.touch, .parameters = &parameters};
    input.tool.position_mm = {-2, 0, 1};
    algorithm->reset(input);
    std::mt19937_64 random(11);
    const auto unit = [&] { return double(random() >> 11) * 0x1p-53 - 0.5; };
    uint32_t most = 0;
    int held = 0;
    for (int tick = 0; tick < 3000; ++tick) {
        const double along = 0.3e-3 * tick * 1e3; // 0.3 m/s
        dvec3 to(2.0 * std::sin(along / 2.0), 2.0 * std::cos(along / 3.0), tick < 20 ? 1 : -1.0);
        if (tick % 10 == 9)
            to = {5.0 * unit(), 5.0 * unit(), -2.0};
        input.velocity_mm_per_s = (to - input.tool.position_mm) / input.dt_s;
        input.tool.position_mm = to;
        const haptics::TickOutput out = algorithm->tick(input);
        most = std::max(most, out.iterations);
        held += out.contact != haptics::Contact::free;
        ASSERT_GE(out.proxy.position_mm.z, -0.06) << tick;
    }
    EXPECT_GE(held, 2900);
    // The last query goes beyond. A sweep across the sheet, which lies in one layer of cells, is
    // looked along in as many pieces as there are cells in a row, each of two by two cells at most.
    // After it at most six more look about the proxy, into two by two cells, too: those of
    // off_the_faces() and rest_at(), for the hand that friction draws and for the hand itself.
    ASSERT_EQ(made->cells.z, 1);
    uint32_t densest = 0;
    for (size_t c = 0; c + 1 < made->first.size(); ++c)
        densest = std::max(densest, made->first[c + 1] - made->first[c]);
    const int64_t beyond = int64_t{densest} * 4 * (made->cells.x + 6);
    EXPECT_LT(beyond, 2 * haptics::kMostLooks); // or the bound says little
    EXPECT_LE(most, haptics::kMostLooks + beyond);
}

} // namespace
} // namespace palpate::touch
