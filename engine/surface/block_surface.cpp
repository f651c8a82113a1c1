#include "engine/surface/block_surface.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <bit>

#include "engine/base/assert.h"
#include "engine/surface/block_changes.h"
#include "engine/surface/block_join.h"
#include "engine/surface/block_reader.h"
#include "engine/surface/sign_field.h"

namespace palpate {

namespace {

using namespace block;

constexpr int kBlocksAcross = static_cast<int>(kBlocksPerSide);
constexpr size_t kWorthThreads = 8; // blocks; fewer are done sooner than threads wake up

} // namespace

struct BlockSurface::Worker {
    BlockMesher mesher;
};

BlockSurface::BlockSurface(const Volume& volume, float iso, const SurfaceOptions& options)
    : volume_(volume), iso_(iso), options_(options), lead_(options.closed_at_border ? 1 : 0) {
    const SignField field(volume, iso, options.closed_at_border);
    count_ = field.end_block() + lead_;
    mesh_.resize(static_cast<size_t>(count_.x) * count_.y * count_.z);
    for (int i = 0; i < std::max(1, tbb::this_task_arena::max_concurrency()); ++i)
        workers_.push_back(std::make_unique<Worker>());
    std::vector<glm::ivec3> crossed;
    const glm::ivec3 first = field.first_brick(), end = field.end_brick();
    for (int z = first.z; z < end.z; ++z)
        for (int y = first.y; y < end.y; ++y)
            for (int x = first.x; x < end.x; ++x)
                for (uint64_t left = field.crossed_blocks({x, y, z}); left != 0; left &= left - 1)
                    crossed.push_back(glm::ivec3(x, y, z) * kBlocksAcross +
                                      block_in_brick(std::countr_zero(left)));
    remesh(crossed);
}

BlockSurface::~BlockSurface() = default;
BlockSurface::BlockSurface(BlockSurface&&) noexcept = default;
BlockSurface& BlockSurface::operator=(BlockSurface&&) noexcept = default;

size_t BlockSurface::slot(glm::ivec3 block) const {
    const glm::ivec3 at = block + lead_;
    return static_cast<size_t>(at.x) +
           static_cast<size_t>(count_.x) *
               (static_cast<size_t>(at.y) +
                static_cast<size_t>(count_.y) * static_cast<size_t>(at.z));
}

const BlockMesh* BlockSurface::block(glm::ivec3 position) const {
    const glm::ivec3 at = position + lead_;
    if (glm::any(glm::lessThan(at, glm::ivec3(0))) || glm::any(glm::greaterThanEqual(at, count_)))
        return nullptr;
    const uint32_t mesh = mesh_[slot(position)];
    return mesh == 0 ? nullptr : &meshes_[mesh - 1];
}

BlockSurface::Update BlockSurface::update(const Volume& after) {
    return update(after, changed_bricks(volume_, after));
}

BlockSurface::Update BlockSurface::update(const Volume& after,
                                          std::span<const ChangedBrick> changed) {
    PALPATE_ASSERT(after.size() == volume_.size() && after.type() == volume_.type());
    Update done;
    done.blocks =
        blocks_that_read(volume_, after, changed, options_, glm::ivec3(-lead_), count_ - lead_);
    volume_ = after;
    remesh(done.blocks);
    for (const glm::ivec3& b : done.blocks)
        if (const BlockMesh* mesh = block(b))
            done.triangles += mesh->triangles.size();
    return done;
}

void BlockSurface::remesh(std::span<const glm::ivec3> blocks) {
    // Blocks that may hold something get a mesh to write to; the others lose theirs.
    std::vector<glm::ivec3> crossed;
    for (const glm::ivec3& b : blocks) {
        uint32_t& mesh = mesh_[slot(b)];
        if (mesh != 0)
            triangles_ -= meshes_[mesh - 1].triangles.size();
        if (lead_ == 0 && is_on_one_side(volume_, iso_, b)) {
            if (mesh != 0) {
                meshes_[mesh - 1] = {};
                free_.push_back(mesh - 1);
                mesh = 0;
            }
            continue;
        }
        crossed.push_back(b);
        if (mesh != 0)
            continue;
        if (free_.empty()) {
            free_.push_back(static_cast<uint32_t>(meshes_.size()));
            meshes_.emplace_back();
        }
        mesh = free_.back() + 1;
        free_.pop_back();
    }
    const size_t workers = crossed.size() < kWorthThreads ? 1 : workers_.size();
    const auto work = [&](size_t w) {
        BlockReader reader(volume_, options_.closed_at_border);
        for (size_t i = w; i < crossed.size(); i += workers)
            remesh_one(crossed[i], reader, *workers_[w]);
    };
    if (workers == 1)
        work(0);
    else
        tbb::parallel_for(size_t{0}, workers, work);
    for (const glm::ivec3& b : crossed) {
        uint32_t& mesh = mesh_[slot(b)];
        triangles_ += meshes_[mesh - 1].triangles.size();
        if (meshes_[mesh - 1].empty()) {
            free_.push_back(mesh - 1);
            mesh = 0;
        }
    }
}

void BlockSurface::remesh_one(glm::ivec3 at, BlockReader& reader, Worker& worker) {
    reader.read(at, worker.mesher.samples());
    const glm::ivec3 last_sample = glm::ivec3(volume_.size()) - 1 + lead_;
    const Place place{at * kSide, glm::vec3(spacing_mm(volume_.grid()))};
    const BlockMesher::Result made =
        worker.mesher.mesh(glm::min(last_sample - at * kSide, glm::ivec3(9)), place, iso_,
                           options_.topology, options_.normals == SurfaceNormals::gradient);
    BlockMesh& mesh = meshes_[mesh_[slot(at)] - 1];
    mesh.positions.assign(made.positions, made.positions + made.vertices);
    if (made.normals)
        mesh.normals.assign(made.normals, made.normals + made.vertices);
    else
        mesh.normals.clear();
    mesh.triangles.assign(made.triangle, made.triangle + made.triangles);
    mesh.edges.assign(made.edges, made.edges + (made.vertices - made.inner));
    mesh.own_edges = static_cast<uint32_t>(made.own_edges);
    mesh.inner = static_cast<uint32_t>(made.inner);
}

std::vector<glm::ivec3> BlockSurface::blocks() const {
    std::vector<glm::ivec3> found;
    const glm::ivec3 end = count_ - lead_;
    const auto bricks = [&](int a, int& first, int& last) {
        first = -lead_;
        last = (end[a] - 1 + kBlocksAcross) / kBlocksAcross - 1;
    };
    glm::ivec3 first, last;
    for (int a = 0; a < 3; ++a)
        bricks(a, first[a], last[a]);
    for (int z = first.z; z <= last.z; ++z)
        for (int y = first.y; y <= last.y; ++y)
            for (int x = first.x; x <= last.x; ++x)
                for (int n = 0; n < static_cast<int>(kBlocksPerBrick); ++n) {
                    const glm::ivec3 at = glm::ivec3(x, y, z) * kBlocksAcross + block_in_brick(n);
                    if (block(at))
                        found.push_back(at);
                }
    return found;
}

Mesh BlockSurface::mesh() const {
    std::vector<PlacedBlock> placed;
    for (const glm::ivec3& at : blocks())
        placed.push_back({at, block(at)});
    return join_blocks(volume_.grid(), options_, placed);
}

} // namespace palpate
