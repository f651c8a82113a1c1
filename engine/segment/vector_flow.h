#pragma once

#include "engine/segment/gaussian.h"

namespace palpate {

// Gradient vector flow (Xu and Prince, IEEE Trans. Image Processing 1998): the field v that
// minimises the integral of mu |grad v|^2 + |g|^2 |v - g|^2, with g the gradient of an edge map:
// the edges' gradients, spread smoothly to where there are none. It solves
//   mu laplace(v) = |g|^2 (v - g)
// in each component, with no flow through the border; mm along all axes, also unequal ones. The
// edge map is rescaled to 0 .. 1 before, so that mu has no unit and g is per mm. g is the
// derivative of gaussian.h with sigma 0, in the world.
//
// Solved by multigrid: red-black relaxation, residuals averaged to grids of twice the spacing
// (along the axes of the finest ones only, until the spacing is even), corrections interpolated
// linearly. Work a cycle is that of some five relaxations; each reduces the residual by about 3
// where sizes stay even from level to level, and by 1.4 to 2 where one is odd (measured, 16 to 96
// samples a side). Rounding of floats ends it at 1e-6 to 4e-5 there, more on finer grids.
//
// Where the edge map has no data, g is 0 and so does not draw the field; the result has no data
// there. The same bits for any number of threads.
//
// Memory: 2.5 volumes of floats beside the edge map and the result, for one component at a time (3
// where the first coarse grid has a quarter of the samples, as one axis is coarser); an edge map
// that nobody else holds is freed before (but for one with places without data).
struct VectorFlowOptions {
    double mu = 0.2;        // > 0
    double residual = 1e-4; // to end at: |residual| / ||g|^2 g|, root mean square; 1e-6 .. 1
    int most_cycles = 60;   // an error after so many
    // The result is a u16 volume of packed floats (packed_floats.h), without places of no data, and
    // |g|^2 is kept in 16 bits: half a volume less while it is computed.
    bool packed = false;
};

struct VectorFlowReport {
    double residual = 0;
    int cycles = 0;
};

// One component along the world's axis 0 .. 2, f32. Refused: axes that are not perpendicular.
Result<Volume> vector_flow(Volume edges, int axis, const VectorFlowOptions& options,
                           const Task& task, VectorFlowReport* report = nullptr);

// All three.
Result<VectorField> vector_flow(const Volume& edges, const VectorFlowOptions& options,
                                const Task& task);

// The length of all three: f32. |g|^2 is kept as PackedWeights, which changes no component by more
// than 2^-12 of the largest |v - g|: a weight off by e W moves the solution of (W + L) v = W g by
// (W + L)^-1 e W (g - v), and (W + L)^-1 W is a mean. The length of the first components is kept so
// too while the next is solved, which adds twice 2^-12 of it. Memory: as above.
Result<Volume> vector_flow_length(const Volume& edges, const VectorFlowOptions& options,
                                  const Task& task);

} // namespace palpate
