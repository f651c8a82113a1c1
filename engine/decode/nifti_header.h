#pragma once

#include <array>
#include <cstddef>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include "engine/io/decoder.h"

namespace palpate::io {

constexpr size_t kNifti1Bytes = 348;
constexpr size_t kNifti2Bytes = 540;

// The fields of a NIfTI-1, NIfTI-2 or Analyze 7.5 header that matter here, in native byte order.
// Sources: nifti1.h and nifti2.h of the NIfTI working group (nifti.nimh.nih.gov).
struct NiftiHeader {
    enum class Kind { analyze, nifti1, nifti2 };
    Kind kind{};
    bool pair = false; // voxels lie in a .img file beside the header
    bool big_endian = false;
    std::array<int64_t, 8> dim{}; // [0] is how many of the others count
    int datatype = 0;
    std::array<double, 8> pixdim{}; // [0] < 0: the third axis of the qform is turned round
    double vox_offset = 0;
    double scl_slope = 0, scl_inter = 0;
    int xyzt_units = 0;
    int qform_code = 0, sform_code = 0;
    glm::dvec3 quatern{}; // b, c, d
    glm::dvec3 qoffset{}; // in the file's unit
    glm::dmat4 srow{1};   // world RAS from index, in the file's unit
};

// From the first bytes of a file, unpacked; at least kNifti1Bytes of them, or kNifti2Bytes for
// NIfTI-2. An error begins with `name`.
Result<NiftiHeader> parse_nifti_header(const std::string& name, std::span<const std::byte> bytes);

// The places of the samples, LPS millimetres: the sform where its code is above 0, else the qform,
// else spacing alone with a warning. Shear is kept as written. An sform that cannot be used (of
// zeros, say) gives way to the qform with a warning; an error where there is none either.
Result<Grid> nifti_grid(const std::string& name, const NiftiHeader& header, glm::uvec3 size,
                        std::vector<std::string>& warnings);

} // namespace palpate::io
