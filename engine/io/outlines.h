#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "engine/base/polygon.h"

namespace palpate::io {

// Points of a closed polygon in the plane of a slice, in samples: the centre of
// sample (i, j) is at (i, j).
using Outline = std::vector<glm::dvec2>;

// The outlines of the samples that carry `label` in a slice of size.x * size.y
// samples, x fastest.
//
// They run along the edges of samples, so that they enclose exactly the area of
// the samples that they are made of. Each is one polygon around samples that
// are neighbours across edges. Its holes are joined to it by channels of no
// width, the keyhole technique of DICOM (PS3.3 C.8.8.6.3).
std::vector<Outline> outlines_of(std::span<const uint16_t> slice, glm::uvec2 size, uint16_t label);

// Whether a point lies within a polygon, in samples both.
using palpate::contains;

// The area that polygons enclose of each sample of a slice, 0 .. 1, x fastest.
// Polygons that lie within another take their area away, and give it again
// within the next, as even-odd filling does; where the outlines of two cross,
// areas are added and cut off at 1. Coordinates are finite.
std::vector<float> covered_areas(std::span<const Outline> polygons, glm::uvec2 size);

} // namespace palpate::io
