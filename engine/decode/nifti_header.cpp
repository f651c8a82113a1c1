#include "engine/decode/nifti_header.h"

#include <cmath>
#include <string_view>

#include "engine/decode/affine.h"
#include "engine/decode/header_fields.h"

namespace palpate::io {

namespace {

NiftiHeader read_version_1(const HeaderFields& fields) {
    NiftiHeader header;
    const std::string_view magic = fields.text(344, 4);
    const bool single = magic == std::string_view("n+1\0", 4);
    header.pair = !single;
    header.kind = single || magic == std::string_view("ni1\0", 4) ? NiftiHeader::Kind::nifti1
                                                                  : NiftiHeader::Kind::analyze;
    fields.copy<int16_t>(40, header.dim);
    header.datatype = fields.at<int16_t>(70);
    fields.copy<float>(76, header.pixdim);
    header.vox_offset = fields.at<float>(108);
    if (header.kind == NiftiHeader::Kind::analyze)
        return header;
    header.scl_slope = fields.at<float>(112);
    header.scl_inter = fields.at<float>(116);
    header.xyzt_units = fields.at<uint8_t>(123);
    header.qform_code = fields.at<int16_t>(252);
    header.sform_code = fields.at<int16_t>(254);
    header.quatern = fields.vector<float>(256);
    header.qoffset = fields.vector<float>(268);
    header.srow = fields.rows<float>(280);
    return header;
}

NiftiHeader read_version_2(const HeaderFields& fields) {
    NiftiHeader header;
    header.kind = NiftiHeader::Kind::nifti2;
    header.pair = fields.text(4, 4) != std::string_view("n+2\0", 4);
    header.datatype = fields.at<int16_t>(12);
    fields.copy<int64_t>(16, header.dim);
    fields.copy<double>(104, header.pixdim);
    header.vox_offset = static_cast<double>(fields.at<int64_t>(168));
    header.scl_slope = fields.at<double>(176);
    header.scl_inter = fields.at<double>(184);
    header.qform_code = fields.at<int32_t>(344);
    header.sform_code = fields.at<int32_t>(348);
    header.quatern = fields.vector<double>(352);
    header.qoffset = fields.vector<double>(376);
    header.srow = fields.rows<double>(400);
    header.xyzt_units = fields.at<int32_t>(500);
    return header;
}

double mm_per_unit(const std::string& name, int xyzt_units, std::vector<std::string>& warnings) {
    switch (xyzt_units & 7) {
        case 0: // unknown: millimetres by custom
        case 2:
            return 1;
        case 1:
            return 1000;
        case 3:
            return 0.001;
    }
    warnings.push_back(fmt::format("{}: expected a unit of length 0 to 3, found {}; mm are assumed",
                                   name, xyzt_units & 7));
    return 1;
}

// nifti1.h, method 2: the unit quaternion (a, b, c, d) with a >= 0 left out.
glm::dmat3 rotation(glm::dvec3 bcd) {
    double a = 1 - glm::dot(bcd, bcd);
    if (a < 1e-7) { // a half turn, or rounding past it
        bcd = glm::normalize(bcd);
        a = 0;
    } else {
        a = std::sqrt(a);
    }
    const double b = bcd.x, c = bcd.y, d = bcd.z;
    return {{a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)},
            {2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b)},
            {2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - b * b - c * c}};
}

} // namespace

Result<NiftiHeader> parse_nifti_header(const std::string& name, std::span<const std::byte> bytes) {
    if (bytes.size() < kNifti1Bytes)
        return fail("{}: expected a NIfTI header of {} bytes, found {}", name, kNifti1Bytes,
                    bytes.size());
    for (const bool big_endian : {false, true}) {
        const HeaderFields fields(bytes, big_endian);
        const auto header_bytes = static_cast<size_t>(fields.at<uint32_t>(0));
        if (header_bytes != kNifti1Bytes && header_bytes != kNifti2Bytes)
            continue;
        if (bytes.size() < header_bytes)
            return fail("{}: expected a NIfTI-2 header of {} bytes, found {}", name, header_bytes,
                        bytes.size());
        if (const std::string_view magic = fields.text(4, 4);
            header_bytes == kNifti2Bytes && magic != std::string_view("n+2\0", 4) &&
            magic != std::string_view("ni2\0", 4))
            return fail("{}: expected the mark n+2 or ni2 of NIfTI-2, found none", name);
        NiftiHeader header =
            header_bytes == kNifti1Bytes ? read_version_1(fields) : read_version_2(fields);
        header.big_endian = big_endian;
        return header;
    }
    return fail("{}: expected a header that begins with its size {} or {}, found {}", name,
                kNifti1Bytes, kNifti2Bytes, HeaderFields(bytes, false).at<uint32_t>(0));
}

namespace {

// The method of the qform: spacing, a quaternion and an offset.
Result<Grid> qform_grid(const std::string& name, const NiftiHeader& header, glm::uvec3 size,
                        double unit) {
    glm::dmat3 steps = rotation(header.quatern);
    if (header.pixdim[0] < 0)
        steps[2] = -steps[2];
    for (int axis = 0; axis < 3; ++axis)
        steps[axis] *= std::abs(header.pixdim[axis + 1]) * unit;
    return grid_from_columns(name, size, steps, header.qoffset * unit, kRas);
}

// Why a matrix is of no use, without the name of the file.
std::string reason(const std::string& name, const Error& error) {
    return error.message.starts_with(name + ": ") ? error.message.substr(name.size() + 2)
                                                  : error.message;
}

} // namespace

Result<Grid> nifti_grid(const std::string& name, const NiftiHeader& header, glm::uvec3 size,
                        std::vector<std::string>& warnings) {
    const double unit = mm_per_unit(name, header.xyzt_units, warnings);
    if (header.sform_code > 0) {
        const Result<Grid> sform = grid_from_columns(name, size, glm::dmat3(header.srow) * unit,
                                                     glm::dvec3(header.srow[3]) * unit, kRas);
        if (sform)
            return sform;
        const std::string why = reason(name, sform.error());
        if (header.qform_code <= 0)
            return fail("{}: its sform (code {}) cannot be used: {}; it has no qform (code {})",
                        name, header.sform_code, why, header.qform_code);
        Result<Grid> qform = qform_grid(name, header, size, unit);
        if (!qform)
            return fail(
                "{}: neither its sform (code {}: {}) nor its qform (code {}: {}) can be used", name,
                header.sform_code, why, header.qform_code, reason(name, qform.error()));
        warnings.push_back(
            fmt::format("{}: its sform (code {}) cannot be used: {}; its qform (code {}) is taken",
                        name, header.sform_code, why, header.qform_code));
        return qform;
    }
    if (header.qform_code > 0)
        return qform_grid(name, header, size, unit);
    warnings.push_back(fmt::format(
        "{}: stores spacing but no position; axes are taken as right, anterior, superior, and "
        "left and right may be swapped",
        name));
    glm::dmat3 steps(1);
    for (int axis = 0; axis < 3; ++axis)
        steps[axis] *= std::abs(header.pixdim[axis + 1]) * unit;
    return grid_from_columns(name, size, steps, glm::dvec3(0.0), kRas);
}

} // namespace palpate::io
