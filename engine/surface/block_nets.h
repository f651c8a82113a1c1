#pragma once

#include <glm/glm.hpp>
#include <utility>
#include <vector>

#include "engine/surface/surface_nets.h"
#include "engine/volume/changes.h"

namespace palpate {

// How walls between labels are made to be looked at.
struct BlockNetsOptions {
    uint32_t rounds = 1;        // of strong smoothing
    double bound = 0.49;        // most a vertex may move on each axis, in samples
    uint32_t normal_rounds = 3; // of wall_normals()
};

// The walls between all labels of a volume that is being edited, kept up to date block by block of
// 8^3 cells: those of surface_nets(), with the same bits, and with normals.
//
// Each block is complete: vertices that it shares with others are repeated, so that it can be
// uploaded alone. An update makes the walls again in a box about each changed place, as far as
// smoothing and normals reach from there, and replaces the blocks within. There it smooths only
// what can have moved: all other vertices are kept, 16 bytes each.
class BlockNets {
 public:
    struct Block {
        std::vector<glm::vec3> positions; // mm, mesh space of the volume
        std::vector<glm::vec3> normals;   // wall_normals()
        std::vector<glm::uvec3> triangles;
        std::vector<uint32_t> labels; // of triangles: label | outer label << 16
    };

    explicit BlockNets(const Volume& labels, const BlockNetsOptions& options = {});

    const Volume& labels() const { return labels_; }
    uint32_t block_count() const { return static_cast<uint32_t>(blocks_.size()); }
    // By number, x fastest; block (0, 0, 0) begins with cell (0, 0, 0). Empty where no wall is.
    const Block& block(uint32_t number) const { return blocks_[number]; }
    Block take(uint32_t number) { return std::exchange(blocks_[number], {}); } // is empty then

    // The numbers, in rising order, of the blocks that were made again. `after` has the grid of
    // labels().
    std::vector<uint32_t> update(const Volume& after);

 private:
    // The vertices of a block's own cells, by cell, x fastest.
    struct Kept {
        std::vector<uint16_t> cells; // within the block
        std::vector<glm::vec3> positions;
    };
    // Boxes of blocks and of cells are as those of samples: the first and the last on each axis.
    ChangedBox cells_moved_by(const ChangedBox& samples) const;
    ChangedBox blocks_moved_by(const ChangedBox& samples) const;
    ChangedBox cells_needed_for(const ChangedBox& blocks) const;
    double work_of(const ChangedBox& samples) const;
    void merge(std::vector<ChangedBox>& changed) const;
    void make(const ChangedBox& blocks, const std::vector<ChangedBox>& changed);
    glm::vec3 kept_vertex(glm::ivec3 cell, uint32_t n) const;
    uint32_t number_of(glm::ivec3 block) const;

    Volume labels_;
    BlockNetsOptions options_;
    glm::ivec3 count_; // of blocks on each axis
    std::vector<Block> blocks_;
    std::vector<Kept> kept_; // of each block
};

} // namespace palpate
