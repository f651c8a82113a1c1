#include "engine/surface/block_nets.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <span>

#include "engine/base/assert.h"
#include "engine/surface/net_normals.h"
#include "engine/volume/box.h"
#include "engine/volume/builder.h"
#include "engine/volume/changes.h"

namespace palpate {

namespace {

constexpr int kNetSide = 8;        // cells
constexpr size_t kMostBoxes = 512; // that are looked at pair by pair

// Samples first .. first + size - 1 as a volume of their own.
Volume copied(const Volume& labels, glm::ivec3 first, glm::ivec3 size) {
    std::vector<uint16_t> samples(size_t(size.x) * size_t(size.y) * size_t(size.z));
    read_box(labels, first, size, {size_t(size.x), size_t(size.x) * size_t(size.y)},
             samples.data());
    Grid grid = labels.grid();
    grid.size = glm::uvec3(size);
    return make_volume<uint16_t>(grid, samples);
}

double volume_of(glm::ivec3 first, glm::ivec3 last) {
    const glm::dvec3 size(last - first + 1);
    return size.x * size.y * size.z;
}

// A cell's number in its block, x fastest.
uint16_t place_in_block(glm::ivec3 cell) {
    const glm::ivec3 at = cell % kNetSide;
    return static_cast<uint16_t>(at.x + kNetSide * (at.y + kNetSide * at.z));
}

// Lists the cells of each of some blocks, in its order, from the cells of all.
class BlockLists {
 public:
    BlockLists(const ChangedBox& blocks, const std::vector<glm::ivec3>& cells)
        : first_(size_t(volume_of(blocks.first, blocks.last)) + 2, 0), listed_(cells.size()) {
        const glm::ivec3 size = blocks.last - blocks.first + 1;
        const auto list_of = [&](glm::ivec3 cell) { // past all: of no block here
            const glm::ivec3 at = cell / kNetSide - blocks.first;
            const bool is_here = glm::all(glm::greaterThanEqual(at, glm::ivec3(0))) &&
                                 glm::all(glm::lessThan(at, size));
            return is_here ? static_cast<size_t>(at.x + size.x * (at.y + size.y * at.z))
                           : first_.size() - 2;
        };
        for (const glm::ivec3 cell : cells)
            ++first_[list_of(cell) + 1];
        std::partial_sum(first_.begin(), first_.end(), first_.begin());
        std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
        for (uint32_t n = 0; n < cells.size(); ++n)
            listed_[next[list_of(cells[n])]++] = n;
    }
    std::span<const uint32_t> of(size_t list) const {
        return std::span(listed_).subspan(first_[list], first_[list + 1] - first_[list]);
    }

 private:
    std::vector<uint32_t> first_, listed_;
};

// Blocks of a part, with vertices of their own, numbered as triangles come upon them.
class BlockCopy {
 public:
    explicit BlockCopy(const Mesh& mesh) : mesh_(mesh), number_(mesh.positions.size(), kNone) {}

    BlockNets::Block of(std::span<const uint32_t> triangles) {
        BlockNets::Block block;
        block.triangles.reserve(triangles.size());
        block.labels.reserve(triangles.size());
        used_.clear();
        for (const uint32_t n : triangles) {
            glm::uvec3 triangle = mesh_.triangles[n];
            for (int corner = 0; corner < 3; ++corner) {
                uint32_t& number = number_[triangle[corner]];
                if (number == kNone) {
                    number = static_cast<uint32_t>(used_.size());
                    used_.push_back(triangle[corner]);
                }
                triangle[corner] = number;
            }
            block.triangles.push_back(triangle);
            block.labels.push_back(uint32_t{mesh_.labels[n]} | uint32_t{mesh_.outer_labels[n]}
                                                                   << 16);
        }
        block.positions.reserve(used_.size());
        block.normals.reserve(used_.size());
        for (const uint32_t v : used_) {
            block.positions.push_back(mesh_.positions[v]);
            block.normals.push_back(mesh_.normals[v]);
            number_[v] = kNone;
        }
        return block;
    }

 private:
    static constexpr uint32_t kNone = ~0u;
    const Mesh& mesh_;
    std::vector<uint32_t> number_; // of the part's vertices in the block
    std::vector<uint32_t> used_;
};

} // namespace

BlockNets::BlockNets(const Volume& labels, const BlockNetsOptions& options)
    : labels_(labels),
      options_(options),
      count_(glm::ivec3(labels.size()) / kNetSide + 1),
      blocks_(size_t(count_.x) * size_t(count_.y) * size_t(count_.z)),
      kept_(blocks_.size()) {
    PALPATE_ASSERT(labels.type() == ScalarType::u8 || labels.type() == ScalarType::u16);
    make({glm::ivec3(0), count_ - 1}, {{glm::ivec3(0), glm::ivec3(labels.size()) - 1}});
}

uint32_t BlockNets::number_of(glm::ivec3 block) const {
    return static_cast<uint32_t>(block.x + count_.x * (block.y + count_.y * block.z));
}

// A sample is read by the cells on its two sides, and a step of smoothing moves vertices one cell
// away.
ChangedBox BlockNets::cells_moved_by(const ChangedBox& samples) const {
    const auto reach = static_cast<int>(kStepsOfRound * options_.rounds);
    return {samples.first - reach, samples.last + 1 + reach};
}

// A normal reads the triangles about its vertex, and its rounds one cell further each. A wall has
// corners in its own cell and the ones before.
ChangedBox BlockNets::blocks_moved_by(const ChangedBox& samples) const {
    const auto reach = static_cast<int>(1 + options_.normal_rounds);
    const ChangedBox moved = cells_moved_by(samples);
    return {glm::max(moved.first - reach, glm::ivec3(0)) / kNetSide,
            glm::min((moved.last + reach + 1) / kNetSide, count_ - 1)};
}

// Corners of a block's walls lie in its cells and the ones before; each edge from there leads to
// the next cell, and a triangle about that has its owner there or one beyond, and corners one
// before.
ChangedBox BlockNets::cells_needed_for(const ChangedBox& blocks) const {
    const auto reach = static_cast<int>(options_.normal_rounds) + 3;
    return {kNetSide * blocks.first - reach - 1, kNetSide * (blocks.last + 1) - 1 + reach};
}

double BlockNets::work_of(const ChangedBox& samples) const {
    const ChangedBox cells = cells_needed_for(blocks_moved_by(samples));
    return volume_of(cells.first, cells.last);
}

glm::vec3 BlockNets::kept_vertex(glm::ivec3 cell, uint32_t n) const {
    const Kept& kept = kept_[number_of(cell / kNetSide)];
    const auto found = std::ranges::lower_bound(kept.cells, place_in_block(cell));
    PALPATE_ASSERT(found != kept.cells.end() && *found == place_in_block(cell));
    return kept.positions[static_cast<size_t>(found - kept.cells.begin()) + n];
}

// Walls in the blocks anew; `changed` is all that changed since these were made, elsewhere too.
void BlockNets::make(const ChangedBox& blocks, const std::vector<ChangedBox>& changed) {
    const ChangedBox needed = cells_needed_for(blocks);
    ChangedBox moved{glm::ivec3(std::numeric_limits<int>::max()),
                     glm::ivec3(std::numeric_limits<int>::min())};
    for (const ChangedBox& samples : changed) {
        const ChangedBox cells = cells_moved_by(samples);
        const glm::ivec3 low = glm::max(cells.first, needed.first);
        const glm::ivec3 high = glm::min(cells.last, needed.last);
        if (glm::any(glm::greaterThan(low, high)))
            continue;
        moved = {glm::min(moved.first, low), glm::max(moved.last, high)};
    }
    const auto smoothed = static_cast<int>(kStepsOfRound * options_.rounds);
    // Cell c has samples c - 1 and c.
    const glm::ivec3 first =
        glm::max(glm::min(needed.first, moved.first - smoothed) - 1, glm::ivec3(0));
    const glm::ivec3 last =
        glm::min(glm::max(needed.last, moved.last + smoothed), glm::ivec3(labels_.size()) - 1);
    const bool is_whole = first == glm::ivec3(0) && last == glm::ivec3(labels_.size()) - 1;
    const Volume part = is_whole ? labels_ : copied(labels_, first, last - first + 1);
    // The part's own border has walls that the volume has not, and vertices that are not kept.
    // Nobody asks for them.
    const NetMoved unknown{moved.first, moved.last, [&](glm::ivec3 cell, uint32_t n) {
                               const bool is_needed =
                                   glm::all(glm::greaterThanEqual(cell, needed.first)) &&
                                   glm::all(glm::lessThanEqual(cell, needed.last));
                               return is_needed ? kept_vertex(cell, n) : glm::vec3(0.0f);
                           }};
    NetPart made = surface_nets_part(
        part, first, unknown,
        {.passes = 0, .rounds = options_.rounds, .bound = options_.bound, .stop = {}});
    std::vector<uint32_t> near;
    for (uint32_t n = 0; n < made.owners.size(); ++n)
        if (glm::all(glm::greaterThan(made.owners[n], needed.first)) &&
            glm::all(glm::lessThanEqual(made.owners[n], needed.last)))
            near.push_back(n);
    made.mesh.normals = wall_normals(made.mesh, options_.normal_rounds, near);
    const BlockLists walls(blocks, made.owners), vertices(blocks, made.cells);
    const glm::ivec3 size = blocks.last - blocks.first + 1;
    tbb::parallel_for(0, size.z, [&](int z) {
        BlockCopy copy(made.mesh);
        for (int y = 0; y < size.y; ++y)
            for (int x = 0; x < size.x; ++x) {
                const uint32_t number = number_of(blocks.first + glm::ivec3(x, y, z));
                const auto list = static_cast<size_t>(x + size.x * (y + size.y * z));
                blocks_[number] = copy.of(walls.of(list));
                Kept& kept = kept_[number] = {};
                for (const uint32_t v : vertices.of(list)) {
                    kept.cells.push_back(place_in_block(made.cells[v]));
                    kept.positions.push_back(made.mesh.positions[v]);
                }
            }
    });
}

// Boxes become one where that is less work than each by itself.
void BlockNets::merge(std::vector<ChangedBox>& changed) const {
    const auto united = [](const ChangedBox& a, const ChangedBox& b) {
        return ChangedBox{glm::min(a.first, b.first), glm::max(a.last, b.last)};
    };
    if (changed.size() > kMostBoxes) { // all over the volume
        ChangedBox all = changed.front();
        for (const ChangedBox& box : changed)
            all = united(all, box);
        changed = {all};
    }
    for (size_t i = 0; i < changed.size(); ++i)
        for (size_t j = i + 1; j < changed.size();) {
            const ChangedBox both = united(changed[i], changed[j]);
            if (work_of(both) > work_of(changed[i]) + work_of(changed[j])) {
                ++j;
                continue;
            }
            changed[i] = both;
            changed.erase(changed.begin() + static_cast<std::ptrdiff_t>(j));
            j = i + 1;
        }
}

std::vector<uint32_t> BlockNets::update(const Volume& after) {
    PALPATE_ASSERT(after.grid() == labels_.grid());
    std::vector<ChangedBox> changed;
    for (const ChangedBrick& brick : changed_bricks(labels_, after)) {
        const std::vector<ChangedBox> boxes = changed_boxes(labels_, after, brick);
        changed.insert(changed.end(), boxes.begin(), boxes.end());
    }
    merge(changed);
    labels_ = after;
    std::vector<uint32_t> numbers;
    for (const ChangedBox& samples : changed) {
        const ChangedBox blocks = blocks_moved_by(samples);
        make(blocks, changed);
        for (int z = blocks.first.z; z <= blocks.last.z; ++z)
            for (int y = blocks.first.y; y <= blocks.last.y; ++y)
                for (int x = blocks.first.x; x <= blocks.last.x; ++x)
                    numbers.push_back(number_of({x, y, z}));
    }
    std::ranges::sort(numbers);
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
    return numbers;
}

} // namespace palpate
