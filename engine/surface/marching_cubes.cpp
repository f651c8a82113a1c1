#include "engine/surface/marching_cubes.h"

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <array>
#include <bit>
#include <limits>
#include <stdexcept>
#include <vector>

#include "engine/base/timer.h"
#include "engine/mesh/topology.h"
#include "engine/surface/block_cells.h"
#include "engine/surface/block_reader.h"
#include "engine/surface/sign_field.h"

namespace palpate {

namespace {

using namespace block;

constexpr int kBlocksOnSide = static_cast<int>(kBlocksPerSide);

struct CrossedBlock {
    uint32_t number; // in its brick, as block_of()
    Count count;
    uint32_t first_vertex = 0;   // of the mesh
    uint32_t first_triangle = 0; // of the mesh
};

// The crossed blocks of a brick, in order, and where each stands.
struct CrossedBrick {
    std::vector<CrossedBlock> blocks;
    uint64_t crossed = 0;
    const CrossedBlock* find(uint32_t number) const {
        const uint64_t bit = uint64_t{1} << number;
        return crossed & bit ? &blocks[std::popcount(crossed & (bit - 1))] : nullptr;
    }
};

glm::ivec3 block_in_brick(uint32_t number) {
    return {number % kBlocksOnSide, number / kBlocksOnSide % kBlocksOnSide,
            number / (kBlocksOnSide * kBlocksOnSide)};
}

// The memory that a thread needs for one block.
struct Scratch {
    Samples samples;
    Cells cells;
    std::array<uint16_t, kMostEdges> numbers;
    std::array<BorrowedEdge, kMostEdges> borrowed;
    std::array<uint32_t, kEdgeNumbers> vertex_of_edge;
};

// Rows of samples that a block's vertices read.
Rows rows_read(const Cells& cells, Last last) {
    return glm::all(glm::greaterThanEqual(last, Last(kSide))) ? cells.rows : kAllRows;
}

class Extraction {
 public:
    Extraction(const Volume& volume, float iso, const SurfaceOptions& options)
        : volume_(volume),
          iso_(iso),
          options_(options),
          field_(volume, iso, options.closed_at_border, options.stop),
          bricks_(field_.end_brick() - field_.first_brick()),
          crossed_(static_cast<size_t>(bricks_.x) * bricks_.y * bricks_.z) {}

    const SignField& field() const { return field_; }
    uint64_t blocks_crossed() const { return blocks_; }

    bool is_stopped() const { return options_.stop.stop_requested(); }

    void count() {
        tbb::parallel_for(size_t{0}, crossed_.size(), [&](size_t i) {
            if (!is_stopped())
                count_brick(i);
        });
        // Each block's vertices and triangles begin at a running sum, in the order of the mesh.
        for (CrossedBrick& brick : crossed_)
            for (CrossedBlock& b : brick.blocks) {
                b.first_vertex = static_cast<uint32_t>(vertices_);
                b.first_triangle = static_cast<uint32_t>(triangles_);
                vertices_ += b.count.vertices();
                triangles_ += b.count.triangles;
                ++blocks_;
            }
        if (vertices_ > std::numeric_limits<uint32_t>::max() ||
            triangles_ > std::numeric_limits<uint32_t>::max())
            throw std::length_error(fmt::format(
                "a surface of {} vertices and {} triangles, expected fewer than 2^32 of each",
                vertices_, triangles_));
    }

    void allocate(Mesh& mesh) const {
        tbb::parallel_invoke([&] { mesh.triangles.resize(triangles_); },
                             [&] {
                                 mesh.positions.resize(vertices_);
                                 if (options_.normals == SurfaceNormals::gradient)
                                     mesh.normals.resize(vertices_);
                             });
    }

    void emit(Mesh& mesh) const {
        tbb::enumerable_thread_specific<std::unique_ptr<Scratch>> scratches;
        tbb::parallel_for(size_t{0}, crossed_.size(), [&](size_t i) {
            if (crossed_[i].blocks.empty() || is_stopped())
                return;
            std::unique_ptr<Scratch>& scratch = scratches.local();
            if (!scratch)
                scratch = std::make_unique<Scratch>();
            emit_brick(i, *scratch, mesh);
        });
    }

 private:
    glm::ivec3 brick_at(size_t i) const {
        const auto n = static_cast<int64_t>(i);
        return field_.first_brick() + glm::ivec3(n % bricks_.x, n / bricks_.x % bricks_.y,
                                                 n / (static_cast<int64_t>(bricks_.x) * bricks_.y));
    }

    const CrossedBlock* find(glm::ivec3 block) const {
        const glm::ivec3 from_first = block - field_.first_brick() * kBlocksOnSide;
        const glm::ivec3 brick = from_first / kBlocksOnSide, local = from_first % kBlocksOnSide;
        return crossed_[static_cast<size_t>(brick.x) +
                        static_cast<size_t>(bricks_.x) *
                            (static_cast<size_t>(brick.y) +
                             static_cast<size_t>(bricks_.y) * static_cast<size_t>(brick.z))]
            .find(static_cast<uint32_t>(local.x +
                                        kBlocksOnSide * (local.y + kBlocksOnSide * local.z)));
    }

    void count_brick(size_t i) {
        const glm::ivec3 position = brick_at(i);
        uint64_t candidates = field_.crossed_blocks(position);
        if (candidates == 0)
            return;
        CrossedBrick& brick = crossed_[i];
        brick.blocks.reserve(static_cast<size_t>(std::popcount(candidates)));
        BlockReader reader(volume_, options_.closed_at_border);
        Samples samples;
        Cells cells;
        for (; candidates != 0; candidates &= candidates - 1) {
            CrossedBlock b{static_cast<uint32_t>(std::countr_zero(candidates)), {}};
            const glm::ivec3 at = position * kBlocksOnSide + block_in_brick(b.number);
            const Signs signs = field_.signs_of(at);
            const Last last = field_.last_of(at);
            count_edges(signs, last, b.count);
            find_cells(signs, last, cells);
            count_cells(cells, b.count);
            if (options_.topology == SurfaceTopology::correct && b.count.needs_values) {
                reader.read(at, samples);
                count_correct_cells(cells, samples, iso_, b.count);
            }
            if (b.count.edge_vertices == 0 && b.count.triangles == 0)
                continue;
            brick.crossed |= uint64_t{1} << b.number;
            brick.blocks.push_back(b);
        }
    }

    void emit_brick(size_t i, Scratch& s, Mesh& mesh) const {
        const glm::ivec3 position = brick_at(i);
        BlockReader reader(volume_, options_.closed_at_border);
        Place place{{}, glm::vec3(spacing_mm(volume_.grid()))};
        for (const CrossedBlock& b : crossed_[i].blocks) {
            const glm::ivec3 at = position * kBlocksOnSide + block_in_brick(b.number);
            const Signs signs = field_.signs_of(at);
            const Last last = field_.last_of(at);
            find_cells(signs, last, s.cells);
            reader.read(at, s.samples, rows_read(s.cells, last));
            place.origin = at * kSide;

            const int own = own_edges(signs, last, s.numbers.data());
            for (int k = 0; k < own; ++k)
                s.vertex_of_edge[s.numbers[k]] = b.first_vertex + static_cast<uint32_t>(k);
            glm::vec3* positions = mesh.positions.data() + b.first_vertex;
            glm::vec3* normals =
                mesh.normals.empty() ? nullptr : mesh.normals.data() + b.first_vertex;
            make_vertices(s.samples, place, iso_, s.numbers.data(), own, positions, normals);

            std::array<const CrossedBlock*, 8> next{};
            const int borrowed = borrowed_edges(signs, last, s.borrowed.data());
            for (int k = 0; k < borrowed; ++k) {
                const BorrowedEdge& e = s.borrowed[k];
                if (!next[e.owner])
                    next[e.owner] =
                        find(at + glm::ivec3(e.owner & 1, e.owner >> 1 & 1, e.owner >> 2));
                s.vertex_of_edge[e.number] =
                    next[e.owner]->first_vertex + next[e.owner]->count.row_start[e.row] + e.in_row;
            }

            glm::uvec3* triangles = mesh.triangles.data() + b.first_triangle;
            if (options_.topology == SurfaceTopology::correct && b.count.needs_values)
                make_correct_triangles(
                    s.cells, s.vertex_of_edge.data(), s.samples, place, iso_,
                    {triangles, positions + own, normals ? normals + own : normals,
                     b.first_vertex + static_cast<uint32_t>(own)});
            else
                make_triangles(s.cells, s.vertex_of_edge.data(), {triangles, b.count.triangles});
        }
    }

    const Volume& volume_;
    const float iso_;
    const SurfaceOptions options_;
    const SignField field_;
    const glm::ivec3 bricks_;
    std::vector<CrossedBrick> crossed_; // of the field, x fastest
    uint64_t vertices_ = 0, triangles_ = 0, blocks_ = 0;
};

} // namespace

Mesh marching_cubes(const Volume& volume, float iso, const SurfaceOptions& options,
                    SurfaceStages* stages) {
    Mesh mesh;
    mesh.world_from_mesh = world_from_mesh(volume.grid());
    SurfaceStages done;
    Timer timer;
    const auto lap = [&timer] {
        const double ms = timer.ms();
        timer = Timer();
        return ms;
    };
    Extraction extraction(volume, iso, options);
    done.signs_ms = lap();
    extraction.count();
    done.count_ms = lap();
    if (!extraction.is_stopped()) {
        extraction.allocate(mesh);
        done.memory_ms = lap();
        extraction.emit(mesh);
        if (options.normals == SurfaceNormals::triangles && !extraction.is_stopped())
            mesh.normals = vertex_normals(mesh);
        done.emit_ms = lap();
    }
    if (extraction.is_stopped()) // once seen, it stays
        mesh = {.world_from_mesh = mesh.world_from_mesh};
    done.bricks =
        uint64_t{volume.brick_count().x} * volume.brick_count().y * volume.brick_count().z;
    done.bricks_read = extraction.field().bricks_read();
    done.blocks_crossed = extraction.blocks_crossed();
    if (stages)
        *stages = done;
    return mesh;
}

} // namespace palpate
