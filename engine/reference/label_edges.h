#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>

namespace palpate::reference {

// The rule of LabelEdges::smooth, in double. A label's weight at a point is the sum of the linear
// weights of the eight samples about it that have the label; the largest is seen.
struct LabelPlace {
    uint32_t label = 0, other = 0; // of the largest weight, and of the next, if there is one
    double margin = 0.0;           // between these weights
    glm::dvec3 slope{0.0};         // of the margin, per sample
};

// At a place in the map's index space; `label_of` is the label of a sample, 0 beyond the map.
LabelPlace label_place(const std::function<uint32_t(glm::ivec3)>& label_of, glm::dvec3 index);

// How opaque a label lies over a slice so many pixels within its edge. `edge`: another one is seen
// an outline's width away.
double label_cover(uint32_t label, double depth_px, bool edge, double outline_px, double fill);

} // namespace palpate::reference
