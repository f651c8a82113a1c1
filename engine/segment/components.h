#pragma once

#include <optional>
#include <vector>

#include "engine/segment/bit_mask.h"

// Connected pieces of labels: components, islands and holes. Samples are those of a label map, NaN
// is 0; pieces of different labels are never joined. Refused: values that are no labels.
// Memory beside input and result: 16 bytes a run of equal labels along x.
namespace palpate {

struct ComponentsOptions {
    Neighbours neighbours = Neighbours::faces;
    std::optional<uint16_t> label; // that one alone; without: every label apart, or, if
    bool as_mask = false;          // this is set, all samples that are not 0 as one object
    uint64_t least_count = 1;      // components with fewer samples are left out
};

struct Component {
    uint16_t label; // as_mask: that of its first sample
    uint64_t count;
    glm::uvec3 first; // its first sample in memory order
};
struct Components {
    Volume numbers;              // u16: i + 1 in the samples of components[i], else 0
    std::vector<Component> list; // larger ones first, of equal ones the one with the earlier sample
};
// An error where more than 65535 are left.
Result<Components> connected_components(const Volume& labels, const ComponentsOptions& options,
                                        const Task& task);

struct IslandsOptions {
    Neighbours neighbours = Neighbours::corners;
    std::optional<uint16_t> label; // without one each label apart
    double least_ml = 0.0;         // components smaller than this ..
    uint64_t least_count = 0;      // .. or of fewer samples become 0
    bool largest_alone = false;    // so does all but the largest of each label
};
// The map without its islands, in its own type.
Result<Volume> remove_islands(const Volume& labels, const IslandsOptions& options,
                              const Task& task);

// Keeps of the label that a sample has the connected piece with that sample; others become 0.
// Refused: a sample of 0.
struct PieceOptions {
    glm::uvec3 at{}; // below the map's size
    Neighbours neighbours = Neighbours::corners;
};
Result<Volume> keep_piece(const Volume& labels, const PieceOptions& options, const Task& task);

// Gives each connected piece of a label one of its own: the largest keeps it, others get the lowest
// labels that no sample has, larger ones first (of equal ones the one with the earlier sample).
// Pieces smaller than least_ml stay as they are; locked labels are not given. The result has the
// type of the map, or u16 where that does not hold a new label. Refused: label 0; where fewer
// labels are free than pieces.
struct SplitOptions {
    uint16_t label = 1;
    Neighbours neighbours = Neighbours::corners;
    double least_ml = 0.0;
    std::span<const uint16_t> locked{};
};
Result<Volume> split_pieces(const Volume& labels, const SplitOptions& options, const Task& task);

// The map with its holes filled: pieces of 0, joined by `background`, that do not reach the border
// of the volume get the label that shares most faces with them (of equal ones the lowest). With
// `label`, that one alone fills, and holes in which another label lies are left as they are.
struct HolesOptions {
    Neighbours background = Neighbours::faces;
    std::optional<uint16_t> label;
};
Result<Volume> fill_holes(const Volume& labels, const HolesOptions& options, const Task& task);

} // namespace palpate
