#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "engine/segment/task.h"

namespace palpate {

// A piece of surface: how far it is from the other surface, and its area.
struct SurfacePiece {
    float distance_mm; // infinite where there is no other surface
    float area_mm2;
};

// How far the surfaces of two sets of samples are from each other.
//
// The surface of a set passes through the cells of 2 x 2 x 2 samples that are neither all in the
// set nor all out of it; beyond the volume nothing is in it. Each such cell is one piece: its area
// is that of the loops through the middles of the crossed edges (marching cubes; on an ambiguous
// face inside corners lie apart), taken as the length of each loop's vector area, in mm^2; its
// place is the centre of the cell. The distance of a piece is that to the nearest piece of the
// other surface, exact and in mm. So distances are to a cell's size, and 0 where both surfaces
// cross one cell.
struct SurfaceScores {
    double first_mm2 = 0.0, second_mm2 = 0.0; // areas
    // Distances of the pieces that have one. Not defined where just one set is empty; 0 where both
    // are.
    std::optional<double> mean_mm;    // over the area of both surfaces: ASSD
    std::optional<double> rms_mm;     // likewise
    std::optional<double> p95_mm;     // the larger of both directions: 95 % of the area is nearer
    std::optional<double> largest_mm; // the larger of both directions
    // The share of both areas that is at most a tolerance away; 0 where just one set is empty, 1
    // where both are.
    double dice = 1.0;
};

// Pieces of both surfaces; for several labels they may be put together.
struct SurfacePieces {
    std::vector<SurfacePiece> first, second;
};
SurfaceScores surface_scores(SurfacePieces pieces, double tolerance_mm);

// The surfaces of the samples of `label` in the box low .. high (both included) of two maps of one
// size and grid. Refused: a sheared grid. Memory: 14 bytes a sample of the box.
Result<SurfacePieces> surface_pieces(const Volume& first, const Volume& second, uint16_t label,
                                     glm::uvec3 low, glm::uvec3 high, const Task& task);

} // namespace palpate
