#pragma once

#include <string>

#include "engine/base/error.h"
#include "engine/volume/volume.h"

// Input files for a first try on a volume: a hand path for `palpate touch --path` and strokes for
// `palpate edit`. Both begin where a straight line from outside first meets the iso-surface.
namespace palpate {

// A place on an iso-surface and the way into the material.
struct Landing {
    glm::dvec3 at_mm{0.0};          // world mm (LPS)
    glm::dvec3 into{0.0, 1.0, 0.0}; // of unit length, along an axis of the world
};

// The lines run towards posterior, to the sides, anterior, inferior and superior; those through
// the middle of the volume come first, then those beside it. Material that is thicker than two
// samples is preferred to what is thinner. An error where no line comes from below `iso` to `iso`
// or above; samples without data count as below.
Result<Landing> find_landing(const Volume& volume, double iso);

// The text of a path (haptics/device/hand_path.h): straight to the surface, 2 mm into it, or
// as far as samples lie apart, button 0 pressed for half a second there, and back. It lasts 2.5 s.
std::string starter_path(const Landing& landing, const Volume& volume);

// The text of two strokes on grey values (engine/edit/stroke.h), the lowest value left behind: a
// ball cut out at the surface, and a groove milled beside it.
std::string starter_strokes(const Landing& landing, const Volume& volume, double iso);

} // namespace palpate
