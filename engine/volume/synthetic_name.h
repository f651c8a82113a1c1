#pragma once

#include <cstdint>
#include <string>

#include "engine/base/error.h"
#include "engine/volume/volume.h"

namespace palpate {

// A synthetic volume by name: "synthetic:NAME?key=value&key=value".
//
// NAME is phantom, ball, gyroid, torus, gaussian, marschner-lobb, shells, ramp, slab, sheet or
// checkerboard (labels). Keys: size (samples on each axis, N or X,Y,Z; 1 .. 4096 each; default 64)
// and spacing (ratio of the axes' spacings, X,Y,Z; default 1,1,1). The grid is centred on the
// origin and covers the field: +-100 mm for the phantom, +-1 mm for marschner-lobb, +-50 mm for the
// others. Grey values are i16 (0 .. 1000, or HU) or f32 (marschner-lobb, ramp).
//
// Refused when the samples need more than limit_bytes.
Result<Volume> make_synthetic(const std::string& name, uint64_t limit_bytes);

} // namespace palpate
