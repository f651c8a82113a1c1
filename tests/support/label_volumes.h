#pragma once

#include <vector>

#include "engine/mesh/label_surfaces.h"
#include "engine/mesh/topology.h"
#include "engine/surface/surface_nets.h"

namespace palpate {

// The volume that the surface of each label of a mesh encloses, in rising order; background apart.
inline std::vector<LabelVolume> label_volumes(const Mesh& mesh) {
    std::vector<LabelVolume> volumes;
    for_each_label(mesh, [&](uint16_t label, const Mesh& surface) {
        if (label != 0)
            volumes.push_back({label, topology(surface).volume_mm3});
    });
    return volumes;
}

} // namespace palpate
