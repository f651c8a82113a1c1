#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "engine/base/error.h"
#include "engine/volume/volume.h"

namespace palpate {

// A synthetic volume before it is sampled: the arguments of make_volume() and make_brick().
struct SyntheticVolume {
    Grid grid;
    ScalarType type{};
    std::function<double(glm::uvec3 index)> value; // called from several threads
    bool labels = false;
};

// A synthetic volume by name: "synthetic:NAME?key=value&key=value".
//
// NAME is phantom, ball, gyroid, torus, gaussian, marschner-lobb, shells, ramp, slab, sheet or
// checkerboard (labels). Keys: size (samples on each axis, N or X,Y,Z; 1 .. 4096 each; default 64),
// spacing (ratio of the axes' spacings, X,Y,Z; default 1,1,1) and type. The grid is centred on the
// origin and covers the field: +-100 mm for the phantom, +-1 mm for marschner-lobb, +-50 mm for the
// others. Grey values are i16 (0 .. 1000, or HU) or f32 (marschner-lobb, ramp); of the i16 ones,
// type=u16 stores value + 1024, as CT scanners do.
Result<SyntheticVolume> find_synthetic(const std::string& name);

// The same, sampled. Refused when the samples need more than limit_bytes.
Result<Volume> make_synthetic(const std::string& name, uint64_t limit_bytes);

} // namespace palpate
