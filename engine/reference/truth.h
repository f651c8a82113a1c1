#pragma once

#include <span>
#include <vector>

#include "engine/image/image.h"
#include "engine/reference/twin.h"
#include "engine/scene/scene.h"

namespace palpate {

// Grid truth: the picture of the trilinear field itself, without steps, tables or early stops. What
// a renderer differs by from it is its own error; what it differs by from the anatomy is the
// grid's.
//
// Each ray is cut at every cell face and at every point where the cell's cubic passes a knot of the
// transfer function.
//   alpha  Gauss-Legendre on each smooth piece, halved until it changes by less than about 1e-13
//          (1e-9 where shaded) a piece; transfer function as given
//   mip    the exact maximum of each cell's cubic
//   iso    every root of each cell's cubic, none missed
// Slices take their colours from the transfer function instead of its table; all else is as in
// render_twin(), min_transmittance is not used. Slow: for some pixels of a picture.
Image render_truth(const Scene& scene, const SceneData& data, int eye = 0, PixelStride pixels = {});

// Some pixels of it, in the order in which they are named.
std::vector<PixelSample> truth_pixels(const Scene& scene, const SceneData& data,
                                      std::span<const glm::uvec2> pixels);

// One pixel of it; `pixel` may be fractional and outside the picture.
PixelSample truth_pixel(const Scene& scene, const SceneData& data, glm::dvec2 pixel, int eye = 0);

} // namespace palpate
