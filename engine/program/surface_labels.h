#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/json.h"
#include "engine/io/label_names.h"
#include "engine/mesh/mesh.h"
#include "engine/mesh/topology.h"
#include "engine/volume/volume.h"

namespace palpate {

// How many samples have each value of a label map, 0 among them.
std::map<uint16_t, uint64_t> count_labels(const Volume& volume);

// Labels by number or name, as typed. An error says which is neither a number nor one of `names`.
Result<std::vector<uint16_t>> labels_named(std::span<const std::string> texts,
                                           std::span<const LabelName> names);

// A label map in which all labels but these are background. An error where it holds one of them
// nowhere.
Result<Volume> with_labels(const Volume& volume, std::span<const uint16_t> labels);

Json json_of(const MeshTopology& found);

// One entry a label of the volume: its own closed surface in the mesh, beside its voxels and, with
// `exact_passes`, the volume that shared walls smoothed so often enclose in double precision.
Json label_entries(const Mesh& mesh, const Volume& volume, std::optional<uint32_t> exact_passes);

// For shared walls: lines where three or more meet are no fault, unless one label's surface has it.
void count_faults_by_label(Json& report, const Json& labels);

} // namespace palpate
