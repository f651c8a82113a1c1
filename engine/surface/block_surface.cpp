#include "engine/surface/block_surface.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <tuple>

#include "engine/base/assert.h"
#include "engine/mesh/topology.h"
#include "engine/surface/block_reader.h"
#include "engine/surface/sign_field.h"

namespace palpate {

namespace {

using namespace block;

constexpr int kBlocks = static_cast<int>(kBlocksPerSide);
constexpr size_t kWorthThreads = 8; // blocks; fewer are done sooner than threads wake up

glm::ivec3 block_in_brick(int number) {
    return {number % kBlocks, number / kBlocks % kBlocks, number / (kBlocks * kBlocks)};
}

// Which samples of a block differ: bit x of row[z][y].
using Differences = std::array<std::array<uint8_t, kSide>, kSide>;

template <class T>
Differences differences(const Brick& before, const Brick& after, glm::ivec3 block) {
    const BrickSamples<T> a = before.samples<T>(), b = after.samples<T>();
    Differences differ{};
    for (int z = 0; z < kSide; ++z)
        for (int y = 0; y < kSide; ++y) {
            const uint32_t at = offset_in_brick(glm::uvec3(block * kSide + glm::ivec3(0, y, z)));
            for (uint32_t x = 0; x < kSide; ++x) {
                const T was = a[before.stride() * (at + x)], is = b[after.stride() * (at + x)];
                differ[z][y] |= static_cast<uint8_t>((std::memcmp(&was, &is, sizeof(T)) != 0) << x);
            }
        }
    return differ;
}

// Bit n, for the neighbour at (n % 3, n / 3 % 3, n / 9) - 1: it reads a sample that differs. The
// one before reads `head` first samples of the block, the one after its last `tail` ones.
uint32_t readers(const Differences& differ, int head, int tail) {
    const auto in_class = [&](int neighbour, int i) { // does it read sample i of the block?
        return neighbour == 1 || (neighbour == 0 ? i < head : i >= kSide - tail);
    };
    std::array<uint8_t, 9> rows{}; // of the neighbours in y and z
    for (int z = 0; z < kSide; ++z)
        for (int y = 0; y < kSide; ++y)
            if (differ[z][y] != 0)
                for (int n = 0; n < 9; ++n)
                    if (in_class(n % 3, y) && in_class(n / 3, z))
                        rows[n] |= differ[z][y];
    const auto first = static_cast<uint8_t>((1 << head) - 1);
    const auto final = static_cast<uint8_t>(0xff00 >> tail);
    uint32_t found = 0;
    for (int n = 0; n < 9; ++n) {
        found |= static_cast<uint32_t>((rows[n] & first) != 0) << (3 * n);
        found |= static_cast<uint32_t>(rows[n] != 0) << (3 * n + 1);
        found |= static_cast<uint32_t>((rows[n] & final) != 0) << (3 * n + 2);
    }
    return found;
}

// All samples that the cells of a block read lie on one side of iso, by the ranges of blocks.
bool is_on_one_side(const Volume& volume, float iso, glm::ivec3 block) {
    const glm::ivec3 last = (glm::ivec3(volume.size()) - 1) / kSide;
    ValueRange range;
    bool gaps = false, data = false;
    for (int n = 0; n < 8; ++n) {
        const glm::ivec3 at = block + glm::ivec3(n & 1, n >> 1 & 1, n >> 2);
        if (glm::any(glm::greaterThan(at, last)))
            continue;
        const Brick& brick = volume.brick(glm::uvec3(at / kBlocks));
        const ValueRange of_block = brick.block_range(block_of(glm::uvec3(at % kBlocks * kSide)));
        gaps = gaps || brick.no_data_count() > 0;
        data = data || !of_block.empty();
        range.include(of_block);
    }
    return !data || !(range.max >= iso) || (range.min >= iso && !gaps);
}

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
                    crossed.push_back(glm::ivec3(x, y, z) * kBlocks +
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
    const bool gradient = options_.normals == SurfaceNormals::gradient;
    const int head = gradient ? 2 : 1, tail = gradient ? 1 : 0;
    Update done;
    for (const ChangedBrick& brick : changed) {
        const Brick& was = volume_.brick(brick.position);
        const Brick& is = after.brick(brick.position);
        for (uint64_t left = brick.blocks; left != 0; left &= left - 1) {
            const glm::ivec3 local = block_in_brick(std::countr_zero(left));
            const Differences differ = visit_scalar(
                is.type(), [&](auto t) { return differences<decltype(t)>(was, is, local); });
            const glm::ivec3 at = glm::ivec3(brick.position) * kBlocks + local;
            for (uint32_t n = readers(differ, head, tail); n != 0; n &= n - 1) {
                const int i = std::countr_zero(n);
                const glm::ivec3 reader = at + glm::ivec3(i % 3, i / 3 % 3, i / 9) - 1;
                if (glm::all(glm::greaterThanEqual(reader, glm::ivec3(-lead_))) &&
                    glm::all(glm::lessThan(reader, count_ - lead_)))
                    done.blocks.push_back(reader);
            }
        }
    }
    std::sort(done.blocks.begin(), done.blocks.end(), [](glm::ivec3 a, glm::ivec3 b) {
        return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x);
    });
    done.blocks.erase(std::unique(done.blocks.begin(), done.blocks.end()), done.blocks.end());
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
        last = (end[a] - 1 + kBlocks) / kBlocks - 1;
    };
    glm::ivec3 first, last;
    for (int a = 0; a < 3; ++a)
        bricks(a, first[a], last[a]);
    for (int z = first.z; z <= last.z; ++z)
        for (int y = first.y; y <= last.y; ++y)
            for (int x = first.x; x <= last.x; ++x)
                for (int n = 0; n < static_cast<int>(kBlocksPerBrick); ++n) {
                    const glm::ivec3 at = glm::ivec3(x, y, z) * kBlocks + block_in_brick(n);
                    if (block(at))
                        found.push_back(at);
                }
    return found;
}

Mesh BlockSurface::mesh() const {
    const std::vector<glm::ivec3> order = blocks();
    std::vector<uint32_t> first_vertex(meshes_.size()), first_triangle(meshes_.size());
    uint32_t vertices = 0, triangles = 0;
    for (const glm::ivec3& at : order) {
        const uint32_t i = mesh_[slot(at)] - 1;
        first_vertex[i] = vertices;
        first_triangle[i] = triangles;
        vertices += meshes_[i].own_edges + meshes_[i].inner;
        triangles += static_cast<uint32_t>(meshes_[i].triangles.size());
    }
    Mesh mesh;
    mesh.world_from_mesh = world_from_mesh(volume_.grid());
    mesh.positions.resize(vertices);
    if (options_.normals == SurfaceNormals::gradient)
        mesh.normals.resize(vertices);
    mesh.triangles.resize(triangles);
    tbb::parallel_for(size_t{0}, order.size(), [&](size_t k) {
        const glm::ivec3 at = order[k];
        const uint32_t i = mesh_[slot(at)] - 1;
        const BlockMesh& b = meshes_[i];
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
            const uint32_t o = mesh_[slot(owner)] - 1;
            const auto begin = meshes_[o].edges.begin();
            const auto end = begin + meshes_[o].own_edges;
            const auto found = std::lower_bound(begin, end, static_cast<uint16_t>(there));
            PALPATE_ASSERT(found != end && *found == there);
            borrowed[v] = first_vertex[o] + static_cast<uint32_t>(found - begin);
        }
        glm::uvec3* out = mesh.triangles.data() + first_triangle[i];
        for (const glm::uvec3& t : b.triangles) {
            for (int c = 0; c < 3; ++c)
                (*out)[c] = t[c] < own ? first_vertex[i] + t[c] : borrowed[t[c] - own];
            ++out;
        }
    });
    if (options_.normals == SurfaceNormals::triangles)
        mesh.normals = vertex_normals(mesh);
    return mesh;
}

} // namespace palpate
