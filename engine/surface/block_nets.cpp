#include "engine/surface/block_nets.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>

#include "engine/base/assert.h"
#include "engine/surface/net_normals.h"
#include "engine/volume/box.h"
#include "engine/volume/builder.h"
#include "engine/volume/changes.h"

namespace palpate {

namespace {

constexpr int kNetSide = 8;        // cells
constexpr size_t kMostBoxes = 512; // that are looked at pair by pair
constexpr int kBrick = int{kBrickSide}, kBlock = int{kBlockSide};

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

// The triangles of a part that one block owns, with vertices of their own.
BlockNets::Block block_of(const Mesh& mesh, const std::vector<uint32_t>& triangles) {
    BlockNets::Block block;
    std::vector<uint32_t> used;
    for (const uint32_t n : triangles)
        for (int corner = 0; corner < 3; ++corner)
            used.push_back(mesh.triangles[n][corner]);
    std::ranges::sort(used);
    used.erase(std::unique(used.begin(), used.end()), used.end());
    for (const uint32_t v : used) {
        block.positions.push_back(mesh.positions[v]);
        block.normals.push_back(mesh.normals[v]);
    }
    for (const uint32_t n : triangles) {
        glm::uvec3 triangle;
        for (int corner = 0; corner < 3; ++corner)
            triangle[corner] = static_cast<uint32_t>(
                std::ranges::lower_bound(used, mesh.triangles[n][corner]) - used.begin());
        block.triangles.push_back(triangle);
        block.labels.push_back(uint32_t{mesh.labels[n]} | uint32_t{mesh.outer_labels[n]} << 16);
    }
    return block;
}

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
BlockNets::Box BlockNets::blocks_moved_by(const Box& samples) const {
    const auto reach = static_cast<int>(2 * options_.passes + 1 + options_.normal_rounds);
    return {glm::max(samples.first - reach, glm::ivec3(0)) / kNetSide,
            glm::min((samples.last + 1 + reach + 1) / kNetSide, count_ - 1)};
}

// The samples of all cells from which the blocks follow. The cells on the part's own border lie
// outside of these: there it has walls that the volume has not.
BlockNets::Box BlockNets::samples_read_for(const Box& blocks) const {
    const auto reach = static_cast<int>(2 * options_.passes + 1 + options_.normal_rounds);
    return {glm::max(kNetSide * blocks.first - 2 - reach, glm::ivec3(0)),
            glm::min(kNetSide * (blocks.last + 1) - 1 + reach, glm::ivec3(labels_.size()) - 1)};
}

double BlockNets::work_of(const Box& samples) const {
    const Box read = samples_read_for(blocks_moved_by(samples));
    return volume_of(read.first, read.last);
}

void BlockNets::make(const Box& blocks) {
    const Box read = samples_read_for(blocks);
    const bool is_whole = blocks.first == glm::ivec3(0) && blocks.last == count_ - 1;
    const Volume part =
        is_whole ? labels_ : copied(labels_, read.first, read.last - read.first + 1);
    NetPart made =
        surface_nets_part(part, is_whole ? glm::ivec3(0) : read.first,
                          {.passes = options_.passes, .bound = options_.bound, .stop = {}});
    made.mesh.normals = wall_normals(made.mesh, options_.normal_rounds);
    const glm::ivec3 size = blocks.last - blocks.first + 1;
    std::vector<std::vector<uint32_t>> triangles(size_t(size.x) * size_t(size.y) * size_t(size.z));
    const auto list_at = [&](glm::ivec3 at) {
        return size_t(at.x) + size_t(size.x) * (size_t(at.y) + size_t(size.y) * size_t(at.z));
    };
    for (uint32_t n = 0; n < made.owners.size(); ++n) {
        const glm::ivec3 at = made.owners[n] / kNetSide - blocks.first;
        if (glm::all(glm::greaterThanEqual(at, glm::ivec3(0))) && glm::all(glm::lessThan(at, size)))
            triangles[list_at(at)].push_back(n);
    }
    tbb::parallel_for(0, size.z, [&](int z) {
        for (int y = 0; y < size.y; ++y)
            for (int x = 0; x < size.x; ++x)
                blocks_[number_of(blocks.first + glm::ivec3(x, y, z))] =
                    block_of(made.mesh, triangles[list_at({x, y, z})]);
    });
}

// A box about the samples that differ, for each changed block of samples.
std::vector<BlockNets::Box> BlockNets::changed_boxes(const Volume& after) const {
    std::vector<Box> boxes;
    std::vector<uint16_t> before_samples(kBlock * kBlock * kBlock), now_samples(before_samples);
    for (const ChangedBrick& brick : changed_bricks(labels_, after))
        for (uint64_t left = brick.blocks; left != 0; left &= left - 1) {
            const int n = std::countr_zero(left), side = int{kBlocksPerSide};
            const glm::ivec3 first =
                glm::ivec3(brick.position) * kBrick +
                kBlock * glm::ivec3(n % side, n / side % side, n / (side * side));
            if (!glm::all(glm::lessThan(first, glm::ivec3(after.size())))) // padding
                continue;
            const glm::ivec3 size = glm::min(glm::ivec3(kBlock), glm::ivec3(after.size()) - first);
            read_box(labels_, first, size, {kBlock, kBlock * kBlock}, before_samples.data());
            read_box(after, first, size, {kBlock, kBlock * kBlock}, now_samples.data());
            Box box{glm::ivec3(kBlock), glm::ivec3(-1)};
            for (int z = 0; z < size.z; ++z)
                for (int y = 0; y < size.y; ++y)
                    for (int x = 0; x < size.x; ++x) {
                        const auto i = static_cast<size_t>(x + kBlock * (y + kBlock * z));
                        if (before_samples[i] == now_samples[i])
                            continue;
                        box.first = glm::min(box.first, glm::ivec3(x, y, z));
                        box.last = glm::max(box.last, glm::ivec3(x, y, z));
                    }
            if (box.last.x >= 0)
                boxes.push_back({first + box.first, first + box.last});
        }
    return boxes;
}

// Boxes become one where that is less work than each by itself.
void BlockNets::merge(std::vector<Box>& changed) const {
    const auto united = [](const Box& a, const Box& b) {
        return Box{glm::min(a.first, b.first), glm::max(a.last, b.last)};
    };
    if (changed.size() > kMostBoxes) { // all over the volume
        Box all = changed.front();
        for (const Box& box : changed)
            all = united(all, box);
        changed = {all};
    }
    for (size_t i = 0; i < changed.size(); ++i)
        for (size_t j = i + 1; j < changed.size();) {
            const Box both = united(changed[i], changed[j]);
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
    std::vector<Box> changed = changed_boxes(after);
    merge(changed);
    labels_ = after;
    std::vector<uint32_t> numbers;
    for (const Box& samples : changed) {
        const Box blocks = blocks_moved_by(samples);
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
