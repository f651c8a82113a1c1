#include "engine/surface/block_join.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <tuple>

#include "engine/base/assert.h"
#include "engine/mesh/topology.h"

namespace palpate::block {

namespace {

// The position of each block in the list, over the box that holds them all.
class Positions {
 public:
    explicit Positions(std::span<const PlacedBlock> blocks) {
        if (blocks.empty())
            return;
        glm::ivec3 high = low_ = blocks[0].at;
        for (const PlacedBlock& b : blocks) {
            low_ = glm::min(low_, b.at);
            high = glm::max(high, b.at);
        }
        size_ = high - low_ + 1;
        position_.resize(static_cast<size_t>(size_.x) * size_.y * size_.z);
        for (size_t i = 0; i < blocks.size(); ++i)
            position_[slot(blocks[i].at)] = static_cast<uint32_t>(i);
    }
    uint32_t of(glm::ivec3 block) const { return position_[slot(block)]; } // one of the list

 private:
    size_t slot(glm::ivec3 block) const {
        const glm::ivec3 at = block - low_;
        return static_cast<size_t>(at.x) +
               static_cast<size_t>(size_.x) *
                   (static_cast<size_t>(at.y) +
                    static_cast<size_t>(size_.y) * static_cast<size_t>(at.z));
    }
    glm::ivec3 low_{}, size_{};
    std::vector<uint32_t> position_;
};

} // namespace

bool comes_before(glm::ivec3 a, glm::ivec3 b) {
    constexpr int kShift = 2; // rounds down before 0, as the bricks of a closed border lie
    static_assert(kBlocksPerSide == 1u << kShift);
    const auto key = [](glm::ivec3 v) {
        return std::tuple(v.z >> kShift, v.y >> kShift, v.x >> kShift, v.z, v.y, v.x);
    };
    return key(a) < key(b);
}

Mesh join_blocks(const Grid& grid, const SurfaceOptions& options,
                 std::span<const PlacedBlock> blocks) {
    const Positions position(blocks);
    std::vector<uint32_t> first_vertex, first_triangle;
    uint32_t vertices = 0, triangles = 0;
    for (const PlacedBlock& b : blocks) {
        first_vertex.push_back(vertices);
        first_triangle.push_back(triangles);
        vertices += b.mesh->own_edges + b.mesh->inner;
        triangles += static_cast<uint32_t>(b.mesh->triangles.size());
    }
    Mesh mesh;
    mesh.world_from_mesh = world_from_mesh(grid);
    mesh.positions.resize(vertices);
    if (options.normals == SurfaceNormals::gradient)
        mesh.normals.resize(vertices);
    mesh.triangles.resize(triangles);
    tbb::parallel_for(size_t{0}, blocks.size(), [&](size_t i) {
        const glm::ivec3 at = blocks[i].at;
        const BlockMesh& b = *blocks[i].mesh;
        const uint32_t own = b.own_edges + b.inner;
        std::copy_n(b.positions.begin(), own, mesh.positions.begin() + first_vertex[i]);
        if (!mesh.normals.empty())
            std::copy_n(b.normals.begin(), own, mesh.normals.begin() + first_vertex[i]);
        std::vector<uint32_t> borrowed(b.positions.size() - own);
        for (size_t v = 0; v < borrowed.size(); ++v) {
            const int number = b.edges[b.own_edges + v];
            glm::ivec3 owner = at;
            int there = number;
            for (int a = 0; a < 3; ++a)
                if (sample_of(number)[a] == kSide) {
                    ++owner[a];
                    there -= 4 * kSide * Samples::kStride[a];
                }
            const uint32_t o = position.of(owner);
            const std::vector<uint16_t>& edges = blocks[o].mesh->edges;
            const auto end = edges.begin() + blocks[o].mesh->own_edges;
            const auto found = std::lower_bound(edges.begin(), end, static_cast<uint16_t>(there));
            PALPATE_ASSERT(found != end && *found == there);
            borrowed[v] = first_vertex[o] + static_cast<uint32_t>(found - edges.begin());
        }
        glm::uvec3* out = mesh.triangles.data() + first_triangle[i];
        for (const glm::uvec3& t : b.triangles) {
            for (int c = 0; c < 3; ++c)
                (*out)[c] = t[c] < own ? first_vertex[i] + t[c] : borrowed[t[c] - own];
            ++out;
        }
    });
    if (options.normals == SurfaceNormals::triangles)
        mesh.normals = vertex_normals(mesh);
    return mesh;
}

} // namespace palpate::block
