#pragma once

#include "haptics/field/field.h"

// Motion of a point through a field without missing material on its path.
namespace palpate::haptics {

struct Sweep {
    glm::dvec3 point_mm{0.0}; // the end, or where the surface is met
    bool hit = false;
};

// Work a tick may spend on evaluations of the field; what is left undone is done in the next tick.
struct Budget {
    uint32_t evaluations = 4000;
    bool spend(uint32_t count = 1) {
        const bool enough = evaluations >= count;
        evaluations -= enough ? count : evaluations;
        return enough;
    }
};

// The first place on the way from a free point to `to` where the field reaches the iso-value,
// 1e-7 of the contrast on either side; the start is taken for free without a look. Leaps over what
// the ranges of blocks call clear, looks at every quarter of the smallest spacing elsewhere: matter
// that the way crosses on less than that may be missed, a wall may not. Out of budget, it ends
// where it is.
Sweep sweep(Field& field, glm::dvec3 from_mm, glm::dvec3 to_mm, Budget& budget);

} // namespace palpate::haptics
