#pragma once

#include <string>

#include "engine/base/error.h"
#include "engine/volume/grid.h"

namespace palpate::io {

// The axes of a file's world: +1 where an axis of the file points as in LPS.
constexpr glm::dvec3 kLps{1, 1, 1};
constexpr glm::dvec3 kRas{-1, -1, 1};
constexpr glm::dvec3 kLas{1, -1, 1};

// The grid of a file from the columns of its matrix: step vectors of the three index axes and the
// position of sample (0, 0, 0), in millimetres of a world whose axes are `axes` (see above).
//
// The vector of an axis of one sample may be zero: it is replaced by the normal of the others.
// An error begins with `name`: numbers that are not finite, or axes that span no volume.
Result<Grid> grid_from_columns(const std::string& name, glm::uvec3 size, glm::dmat3 steps,
                               glm::dvec3 origin, glm::dvec3 axes = kLps);

} // namespace palpate::io
