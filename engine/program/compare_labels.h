#pragma once

#include <vector>

#include "engine/base/json.h"
#include "engine/measure/label_scores.h"
#include "engine/mesh/topology.h"

namespace palpate {

// The scores of label maps for `palpate compare`; docs/reference/scores.md lists the keys.
struct LabelComparison {
    Json json;
    double least_dice = 1.0, least_surface_dice = 1.0; // of a label
    double largest_mm = 0.0; // surface distance; infinite where just one map has a label
};
// `runs` are more maps of the same object beside A and B; may be empty.
Result<LabelComparison> compare_label_maps(const Volume& first, const Volume& truth,
                                           const std::vector<Volume>& runs,
                                           const LabelScoresOptions& options, const Task& task);

// The volumes that two meshes enclose, whatever the order of their triangles: `volume_mm3` [A, B],
// the sum over the labels of a mesh with labels, null where a mesh without is not closed; and,
// where both have them, `labels` with triangles, area and volume of each label's closed surface.
Json enclosed_volumes(const Mesh& first, const MeshTopology& of_first, const Mesh& second,
                      const MeshTopology& of_second);

} // namespace palpate
