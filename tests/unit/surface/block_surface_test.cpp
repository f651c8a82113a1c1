#include "engine/surface/block_surface.h"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <random>
#include <set>
#include <tuple>

#include "engine/surface/block_count.h"
#include "engine/surface/block_reader.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "engine/volume/synthetic.h"
#include "tests/unit/surface/random_edits.h"

namespace palpate {
namespace {

using testing::expect_same_bytes;
using testing::random_edit;

TEST(BlockSurface, FromScratchIsTheFullExtraction) {
    for (const SurfaceTopology topology : {SurfaceTopology::classic, SurfaceTopology::correct})
        for (const SurfaceNormals normals :
             {SurfaceNormals::none, SurfaceNormals::gradient, SurfaceNormals::triangles})
            for (const bool closed : {false, true}) {
                const Volume volume = testing::noise_volume({50, 33, 41}, ScalarType::f32, 5, 3);
                const SurfaceOptions options{topology, normals, closed};
                const BlockSurface surface(volume, 2.0f, options);
                const Mesh full = marching_cubes(volume, 2.0f, options);
                expect_same_bytes(surface.mesh(), full);
                EXPECT_EQ(surface.triangles(), full.triangles.size());
            }
}

TEST(BlockSurface, IncrementalEqualsFullAfterRandomEdits) {
    testing::expect_incremental_equals_full(/*edits=*/60, /*seed=*/1);
}

TEST(BlockCounter, CountsWhatBlocksHold) {
    for (const bool closed : {false, true})
        for (const ScalarType type : {ScalarType::i8, ScalarType::f32}) {
            Volume volume = testing::noise_volume({21, 17, 33}, type, 5, 9);
            if (type == ScalarType::f32) { // some are missing
                VolumeEdit edit(volume);
                for (uint32_t i = 0; i < 17; ++i)
                    edit.set({i, (7 * i) % 17, (5 * i) % 33}, std::nan(""));
                volume = edit.commit();
            }
            const SurfaceOptions options{.closed_at_border = closed};
            const BlockSurface surface(volume, 2.0f, options);
            block::BlockReader reader(volume, closed);
            block::BlockCounter counter;
            const int lead = closed ? 1 : 0;
            const glm::ivec3 last = glm::ivec3(volume.size()) - 1 + lead;
            uint64_t triangles = 0;
            for (int z = -lead; z < 5; ++z)
                for (int y = -lead; y < 3; ++y)
                    for (int x = -lead; x < 3; ++x) {
                        const glm::ivec3 at(x, y, z);
                        reader.read(at, counter.samples());
                        const auto found = counter.count(glm::min(last - at * 8, 9), 2.0f);
                        const BlockMesh* mesh = surface.block(at);
                        const BlockMesh expected = mesh ? *mesh : BlockMesh();
                        EXPECT_EQ(found.own_edges, expected.own_edges);
                        EXPECT_EQ(found.own_edges + found.borrowed, expected.positions.size());
                        EXPECT_EQ(found.triangles, expected.triangles.size());
                        triangles += found.triangles;
                    }
            EXPECT_EQ(triangles, surface.triangles());
            EXPECT_GT(triangles, 1000u);
        }
}

// The blocks that read a changed sample, found by going over all samples and all blocks.
std::set<std::tuple<int, int, int>> readers_by_force(const Volume& before, const Volume& after,
                                                     int beyond, int ahead) {
    std::set<std::tuple<int, int, int>> found;
    const glm::ivec3 size(before.size());
    const glm::ivec3 blocks = (size - 1) / 8 + 1;
    for (int z = 0; z < size.z; ++z)
        for (int y = 0; y < size.y; ++y)
            for (int x = 0; x < size.x; ++x) {
                const float was = before.value(glm::uvec3(x, y, z));
                const float is = after.value(glm::uvec3(x, y, z));
                if (std::memcmp(&was, &is, sizeof was) == 0)
                    continue;
                for (int k = 0; k < blocks.z; ++k)
                    for (int j = 0; j < blocks.y; ++j)
                        for (int i = 0; i < blocks.x; ++i) {
                            const glm::ivec3 low = glm::ivec3(i, j, k) * 8 - ahead;
                            const glm::ivec3 high = glm::ivec3(i, j, k) * 8 + 7 + beyond;
                            const glm::ivec3 s(x, y, z);
                            if (glm::all(glm::greaterThanEqual(s, low)) &&
                                glm::all(glm::lessThanEqual(s, high)))
                                found.insert({k, j, i});
                        }
            }
    return found;
}

TEST(BlockSurface, MeshesAgainTheBlocksThatReadAChangedSampleAndNoOthers) {
    std::mt19937 random(5);
    Volume volume = testing::noise_volume({70, 40, 35}, ScalarType::i16, 9, 4);
    for (const SurfaceNormals normals : {SurfaceNormals::gradient, SurfaceNormals::none}) {
        BlockSurface surface(volume, 4.0f, {.normals = normals});
        size_t single = 0;
        for (int e = 0; e < 12; ++e) {
            Volume after = volume;
            if (e % 2 == 0) { // one sample, so that the fewest blocks are exact
                VolumeEdit edit(volume);
                const glm::uvec3 at(random() % 70, random() % 40, random() % 35);
                edit.set(at, edit.value(at) + 3.0);
                after = edit.commit();
            } else {
                after = random_edit(volume, random, 6.0);
            }
            const bool gradient = normals == SurfaceNormals::gradient;
            const auto expected =
                readers_by_force(volume, after, gradient ? 2 : 1, gradient ? 1 : 0);
            std::set<std::tuple<int, int, int>> found;
            for (const glm::ivec3& b : surface.update(after).blocks)
                EXPECT_TRUE(found.insert({b.z, b.y, b.x}).second);
            EXPECT_EQ(found, expected);
            single += expected.size() == 1;
            volume = after;
        }
        EXPECT_GT(single, 0u);
    }
}

TEST(BlockSurface, NoChangeMeshesNothing) {
    const Volume volume = testing::noise_volume({40, 40, 40}, ScalarType::u8, 5, 1);
    BlockSurface surface(volume, 2.5f);
    EXPECT_TRUE(surface.update(volume).blocks.empty());
    VolumeEdit edit(volume);
    edit.set({3, 3, 3}, edit.value({3, 3, 3}));
    EXPECT_TRUE(surface.update(edit.commit()).blocks.empty());
}

// Everything taken away, and brought back.
TEST(BlockSurface, SurfacesVanishAndReturn) {
    const Volume ball =
        synthetic::sample(synthetic::sphere_distance(glm::dvec3(20.0), 9.0),
                          make_grid(glm::uvec3(41), glm::dvec3(1.0)), ScalarType::f32);
    VolumeEdit edit(ball);
    for (uint32_t z = 0; z < 41; ++z)
        for (uint32_t y = 0; y < 41; ++y)
            for (uint32_t x = 0; x < 41; ++x)
                edit.set({x, y, z}, -1.0);
    const Volume nothing = edit.commit();
    BlockSurface surface(ball, 0.0f);
    const Mesh before = surface.mesh();
    ASSERT_GT(before.triangles.size(), 100u);
    surface.update(nothing);
    EXPECT_EQ(surface.triangles(), 0u);
    EXPECT_TRUE(surface.blocks().empty());
    EXPECT_TRUE(surface.mesh().positions.empty());
    surface.update(ball);
    expect_same_bytes(surface.mesh(), before);
}

// A block is complete in itself: every triangle of the mesh, from blocks alone.
TEST(BlockSurface, BlocksHoldTheTrianglesOfTheMesh) {
    const Volume volume = testing::noise_volume({30, 20, 25}, ScalarType::u8, 9, 8);
    const BlockSurface surface(volume, 4.0f);
    const Mesh mesh = surface.mesh();
    size_t next = 0;
    for (const glm::ivec3& at : surface.blocks()) {
        const BlockMesh& block = *surface.block(at);
        ASSERT_EQ(block.normals.size(), block.positions.size());
        for (const glm::uvec3& t : block.triangles) {
            for (int c = 0; c < 3; ++c) {
                ASSERT_EQ(block.positions[t[c]], mesh.positions[mesh.triangles[next][c]]);
                ASSERT_EQ(block.normals[t[c]], mesh.normals[mesh.triangles[next][c]]);
            }
            ++next;
        }
    }
    EXPECT_EQ(next, mesh.triangles.size());
    EXPECT_EQ(surface.block({-1, 0, 0}), nullptr);
    EXPECT_EQ(surface.block({400, 0, 0}), nullptr);
}

} // namespace
} // namespace palpate
