#include "engine/surface/local_surface.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <new>
#include <random>
#include <vector>

#include "engine/volume/synthetic.h"
#include "tests/unit/surface/random_edits.h"

namespace {
thread_local long allocations = 0;
}

// Every allocation of this program is counted, so that none by extract() goes unseen.
void* operator new(std::size_t size) {
    ++allocations;
    if (void* p = std::malloc(size))
        return p;
    throw std::bad_alloc();
}
void* operator new(std::size_t size, std::align_val_t alignment) {
    ++allocations;
    const auto a = static_cast<std::size_t>(alignment);
    if (void* p = std::aligned_alloc(a, (size + a - 1) / a * a))
        return p;
    throw std::bad_alloc();
}
void operator delete(void* p) noexcept {
    std::free(p);
}
void operator delete(void* p, std::size_t) noexcept {
    std::free(p);
}
void operator delete(void* p, std::align_val_t) noexcept {
    std::free(p);
}
void operator delete(void* p, std::size_t, std::align_val_t) noexcept {
    std::free(p);
}

namespace palpate {
namespace {

// A triangle as its corners with their normals, and an order of such.
using Corner = std::array<float, 6>;
using Triangle = std::array<Corner, 3>;

Corner corner(glm::vec3 p, glm::vec3 n) {
    return {p.x, p.y, p.z, n.x, n.y, n.z};
}
// The corner that comes first is a matter of tables, the same for both.
std::vector<Triangle> triangles_of(const LocalSurface::Patch& patch) {
    std::vector<Triangle> found;
    for (const glm::uvec3& t : patch.triangles)
        found.push_back({corner(patch.positions[t.x], patch.normals[t.x]),
                         corner(patch.positions[t.y], patch.normals[t.y]),
                         corner(patch.positions[t.z], patch.normals[t.z])});
    std::sort(found.begin(), found.end());
    return found;
}

// Those triangles of a full extraction that lie in the cells of the window.
std::vector<Triangle> triangles_within(const Mesh& mesh, glm::vec3 low_mm, glm::vec3 high_mm) {
    std::vector<Triangle> found;
    for (const glm::uvec3& t : mesh.triangles) {
        bool within = true;
        Triangle triangle;
        for (int c = 0; c < 3; ++c) {
            const glm::vec3 p = mesh.positions[t[c]];
            within = within && glm::all(glm::greaterThanEqual(p, low_mm)) &&
                     glm::all(glm::lessThanEqual(p, high_mm));
            triangle[c] = corner(p, mesh.normals[t[c]]);
        }
        // A triangle in a face of the window belongs to it only if its cell does; none lies in a
        // face of a cell, for all its vertices are off the samples.
        if (within)
            found.push_back(triangle);
    }
    std::sort(found.begin(), found.end());
    return found;
}

TEST(LocalSurface, IsTheFullExtractionWithinTheWindow) {
    std::mt19937 random(2);
    for (const ScalarType type : {ScalarType::i16, ScalarType::f32})
        for (const SurfaceTopology topology : {SurfaceTopology::classic, SurfaceTopology::correct})
            for (const uint32_t side : {2u, 7u, 9u}) {
                const Volume volume = testing::noise_volume({41, 36, 70}, type, 9, 6);
                const Mesh full = marching_cubes(volume, 4.5f, {.topology = topology});
                LocalSurface local(side, topology);
                for (int i = 0; i < 12; ++i) {
                    const glm::dvec3 index(random() % 50 - 4.0, random() % 44 - 4.0,
                                           random() % 78 - 4.0);
                    const LocalSurface::Patch patch = local.extract(volume, index, 4.5f);
                    const glm::vec3 mm(spacing_mm(volume.grid()));
                    const glm::vec3 low = glm::vec3(patch.first_sample) * mm;
                    const glm::vec3 high =
                        glm::vec3(patch.first_sample + static_cast<int>(side) - 1) * mm;
                    EXPECT_EQ(triangles_of(patch), triangles_within(full, low, high));
                    const glm::dvec3 middle = glm::dvec3(patch.first_sample) + 0.5 * (side - 1.0);
                    const glm::dvec3 inner =
                        glm::clamp(index, glm::dvec3(0.5 * (side - 1.0)),
                                   glm::dvec3(volume.size()) - 1.0 - 0.5 * (side - 1.0));
                    EXPECT_LE(glm::length(middle - inner), 0.5 * std::sqrt(3.0));
                }
            }
}

TEST(LocalSurface, ArraysGiveWhatVolumesOfTheSameSamplesGive) {
    std::mt19937 random(3);
    LocalSurface from_array(7), from_volume(7);
    for (int i = 0; i < 20; ++i) {
        std::vector<float> values(343);
        for (float& v : values)
            v = random() % 20 == 0 ? std::numeric_limits<float>::quiet_NaN()
                                   : static_cast<float>(random() % 7);
        const Volume volume = make_volume<float>(make_grid(glm::uvec3(7), {0.5, 1.0, 2.0}), values);
        const auto a = from_array.extract(values, {0.5f, 1.0f, 2.0f}, glm::vec3(0.0f), 3.0f);
        const auto b = from_volume.extract(volume, glm::dvec3(3.0), 3.0f);
        EXPECT_FALSE(a.triangles.empty());
        EXPECT_EQ(triangles_of(a), triangles_of(b));
        const auto moved =
            from_array.extract(values, {0.5f, 1.0f, 2.0f}, glm::vec3(64.0f, 0.0f, -8.0f), 3.0f);
        for (size_t v = 0; v < moved.positions.size(); ++v)
            EXPECT_EQ(moved.positions[v], b.positions[v] + glm::vec3(64.0f, 0.0f, -8.0f));
    }
}

TEST(LocalSurface, SmallVolumesAndStrangeIndicesGiveWhatThereIs) {
    LocalSurface local(7);
    const Volume small = testing::noise_volume({3, 4, 2}, ScalarType::u8, 9, 1);
    const Mesh full = marching_cubes(small, 4.5f);
    const auto patch = local.extract(small, glm::dvec3(1.0), 4.5f);
    EXPECT_EQ(patch.triangles.size(), full.triangles.size());
    for (const double bad :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
        EXPECT_TRUE(local.extract(small, glm::dvec3(1.0, bad, 0.0), 4.5f).triangles.empty());
    EXPECT_EQ(local.extract(small, glm::dvec3(1e300), 4.5f).triangles.size(),
              full.triangles.size());
    const Volume line = testing::noise_volume({1, 40, 1}, ScalarType::u8, 9, 1);
    EXPECT_TRUE(local.extract(line, glm::dvec3(0.0), 4.5f).triangles.empty());
}

TEST(LocalSurface, AllocatesNothing) {
    const Volume volume = testing::noise_volume({64, 64, 64}, ScalarType::i16, 9, 6);
    for (const SurfaceTopology topology : {SurfaceTopology::classic, SurfaceTopology::correct}) {
        LocalSurface local(7, topology);
        std::vector<float> values(343, 1.0f);
        const long before = allocations;
        size_t triangles = 0;
        for (int i = 0; i < 1000; ++i) {
            const glm::dvec3 index(i % 61, i * 7 % 59, i * 13 % 63);
            triangles += local.extract(volume, index, 4.5f).triangles.size();
            values[static_cast<size_t>(i % 343)] += 1.0f;
            triangles +=
                local.extract(values, glm::vec3(1.0f), glm::vec3(0.0f), 1.5f).triangles.size();
        }
        EXPECT_EQ(allocations, before);
        EXPECT_GT(triangles, 1000u);
    }
    const long before = allocations;
    testing::noise_volume({4, 4, 4}, ScalarType::u8, 9, 6);
    EXPECT_GT(allocations, before); // the count counts
}

} // namespace
} // namespace palpate
