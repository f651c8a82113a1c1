#include "engine/surface/block_nets.h"

#include <tbb/parallel_for.h>

#include <algorithm>
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
      blocks_(size_t(count_.x) * size_t(count_.y) * size_t(count_.z)) {
    PALPATE_ASSERT(labels.type() == ScalarType::u8 || labels.type() == ScalarType::u16);
    make({glm::ivec3(0), count_ - 1});
}

uint32_t BlockNets::number_of(glm::ivec3 block) const {
    return static_cast<uint32_t>(block.x + count_.x * (block.y + count_.y * block.z));
}

// A sample is read by the cells on its two sides. A pass moves vertices two cells away; a normal
// reads its triangles, and its rounds one cell further each. A wall has corners in its own cell and
// the ones before.
ChangedBox BlockNets::blocks_moved_by(const ChangedBox& samples) const {
    const auto reach = static_cast<int>(2 * options_.passes + 1 + options_.normal_rounds);
    return {glm::max(samples.first - reach, glm::ivec3(0)) / kNetSide,
            glm::min((samples.last + 1 + reach + 1) / kNetSide, count_ - 1)};
}

// The samples of all cells from which the blocks follow. The cells on the part's own border lie
// outside of these: there it has walls that the volume has not.
ChangedBox BlockNets::samples_read_for(const ChangedBox& blocks) const {
    const auto reach = static_cast<int>(2 * options_.passes + 1 + options_.normal_rounds);
    return {glm::max(kNetSide * blocks.first - 2 - reach, glm::ivec3(0)),
            glm::min(kNetSide * (blocks.last + 1) - 1 + reach, glm::ivec3(labels_.size()) - 1)};
}

double BlockNets::work_of(const ChangedBox& samples) const {
    const ChangedBox read = samples_read_for(blocks_moved_by(samples));
    return volume_of(read.first, read.last);
}

void BlockNets::make(const ChangedBox& blocks) {
    const ChangedBox read = samples_read_for(blocks);
    const bool is_whole = blocks.first == glm::ivec3(0) && blocks.last == count_ - 1;
    const Volume part =
        is_whole ? labels_ : copied(labels_, read.first, read.last - read.first + 1);
    NetPart made =
        surface_nets_part(part, is_whole ? glm::ivec3(0) : read.first, glm::ivec3(labels_.size()),
                          {.passes = options_.passes, .bound = options_.bound, .stop = {}});
    // Corners of a block's walls lie in its cells and the ones before; each edge from there leads
    // to the next cell, and a triangle about that has its owner there or one beyond.
    const int reach = static_cast<int>(options_.normal_rounds) + 3;
    const glm::ivec3 low = kNetSide * blocks.first - reach;
    const glm::ivec3 high = kNetSide * (blocks.last + 1) - 1 + reach;
    std::vector<uint32_t> near;
    for (uint32_t n = 0; n < made.owners.size(); ++n)
        if (glm::all(glm::greaterThanEqual(made.owners[n], low)) &&
            glm::all(glm::lessThanEqual(made.owners[n], high)))
            near.push_back(n);
    made.mesh.normals = wall_normals(made.mesh, options_.normal_rounds, near);
    const glm::ivec3 size = blocks.last - blocks.first + 1;
    const size_t blocks_here = size_t(size.x) * size_t(size.y) * size_t(size.z);
    const auto list_of = [&](uint32_t n) { // of the block that owns a triangle; past all: no such
        const glm::ivec3 at = made.owners[n] / kNetSide - blocks.first;
        const bool is_here =
            glm::all(glm::greaterThanEqual(at, glm::ivec3(0))) && glm::all(glm::lessThan(at, size));
        return is_here
                   ? size_t(at.x) + size_t(size.x) * (size_t(at.y) + size_t(size.y) * size_t(at.z))
                   : blocks_here;
    };
    const auto count = static_cast<uint32_t>(made.owners.size());
    std::vector<uint32_t> first(blocks_here + 2, 0), listed(count);
    for (uint32_t n = 0; n < count; ++n)
        ++first[list_of(n) + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<uint32_t> next(first.begin(), first.end() - 1);
    for (uint32_t n = 0; n < count; ++n)
        listed[next[list_of(n)]++] = n;
    tbb::parallel_for(0, size.z, [&](int z) {
        BlockCopy copy(made.mesh);
        for (int y = 0; y < size.y; ++y)
            for (int x = 0; x < size.x; ++x) {
                const size_t list =
                    size_t(x) + size_t(size.x) * (size_t(y) + size_t(size.y) * size_t(z));
                blocks_[number_of(blocks.first + glm::ivec3(x, y, z))] =
                    copy.of(std::span(listed).subspan(first[list], first[list + 1] - first[list]));
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
        make(blocks);
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
