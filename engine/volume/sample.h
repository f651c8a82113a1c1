#pragma once

#include <array>
#include <glm/glm.hpp>

#include "engine/volume/volume.h"

namespace palpate {

// The trilinear interpolant at a point of index space; NaN outside [0, size - 1] and in any cell
// that has a corner without data. On an axis of one sample, the only coordinate inside is 0.
double trilinear(const Volume& volume, glm::dvec3 index);

// The eight corners of the cell whose lowest corner is `cell`, x fastest; cell + 1 is clamped to
// the last sample. NaN where there is no data.
std::array<float, 8> cell_corners(const Volume& volume, glm::uvec3 cell);

// Central differences of the trilinear interpolant, one sample to each side, in value units per
// sample. Positions beyond the sampled box are clamped to it (differences there are one-sided and
// half as large, as in the ray caster). NaN where a sample is.
glm::dvec3 central_gradient(const Volume& volume, glm::dvec3 index);

// A fast sampler for nearby points: it keeps the last brick and the last cell's corners. Gives the
// same bits as trilinear() and central_gradient(). For one thread; keeps the snapshot alive.
class SampleCursor {
 public:
    explicit SampleCursor(Volume volume);
    double value(glm::dvec3 index);
    glm::dvec3 gradient(glm::dvec3 index); // as central_gradient()

 private:
    float at(glm::uvec3 index);

    Volume volume_;
    glm::uvec3 brick_position_{~0u};
    const Brick* brick_ = nullptr;
    Brick::Pinned pinned_;
    glm::uvec3 cell_{~0u};
    std::array<float, 8> corners_{};
};

} // namespace palpate
