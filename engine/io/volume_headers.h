#pragma once

#include <string>

#include "engine/base/error.h"
#include "engine/volume/grid.h"
#include "engine/volume/scalar.h"

// The bytes before the voxels in each format a volume is written in.
namespace palpate::io {

struct VolumeHeader {
    enum class Packed { nothing, voxels, all };

    std::string bytes;
    Packed packed = Packed::nothing; // the gzipped part
    bool big_endian = false;
};

// Each error begins with `name` and says what the format cannot hold. A modality is one word, or
// empty.

// NIfTI-1, or NIfTI-2 where an axis has more than 32767 samples or 32-bit floats would move a
// sample by more than 0.001 mm. The sform holds the grid; the qform too where the axes are at right
// angles.
VolumeHeader nifti_volume_header(const Grid& grid, ScalarType type);

// Keeps any grid, to the last bit.
VolumeHeader nrrd_volume_header(const Grid& grid, ScalarType type, const std::string& modality);

// `data_file` is LOCAL or the name of the file beside it. Refuses axes not at right angles.
Result<VolumeHeader> meta_image_volume_header(const std::string& name, const Grid& grid,
                                              ScalarType type, const std::string& data_file,
                                              const std::string& modality);

// Legacy structured points, big-endian. Refuses axes that are not those of the world.
Result<VolumeHeader> vtk_volume_header(const std::string& name, const Grid& grid, ScalarType type);

} // namespace palpate::io
