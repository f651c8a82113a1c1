#include "engine/io/volume_headers.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <glm/gtc/quaternion.hpp>

namespace palpate::io {

namespace {

// Cosines of angles between axes smaller than this are rounding of 32-bit headers on the way here.
constexpr double kSquare = 1e-6;
constexpr double kMostMoved_mm = 1e-3;

// Unit vectors of the index axes.
glm::dmat3 directions(const Grid& grid) {
    const glm::dvec3 spacing = spacing_mm(grid);
    glm::dmat3 unit(grid.world_from_index);
    for (int axis = 0; axis < 3; ++axis)
        unit[axis] /= spacing[axis];
    return unit;
}

// The largest cosine between two different index axes: 0 when they are at right angles.
double shear(const Grid& grid) {
    const glm::dmat3 unit = directions(grid);
    return std::max({std::abs(glm::dot(unit[0], unit[1])), std::abs(glm::dot(unit[1], unit[2])),
                     std::abs(glm::dot(unit[2], unit[0]))});
}

// The fields of a NIfTI header; T is float for version 1 and double for version 2.
class NiftiFields {
 public:
    explicit NiftiFields(size_t bytes) : bytes_(bytes, '\0') {}

    template <class T, class From>
    void put(size_t offset, From value) {
        const T stored = static_cast<T>(value);
        std::memcpy(&bytes_[offset], &stored, sizeof stored); // both are little-endian
    }
    void put_text(size_t offset, std::string_view text) {
        bytes_.replace(offset, text.size(), text);
    }
    template <class T>
    void put_vector(size_t offset, glm::dvec3 v) {
        for (int i = 0; i < 3; ++i)
            put<T>(offset + sizeof(T) * i, v[i]);
    }
    template <class T>
    void put_rows(size_t offset, const glm::dmat4& matrix) {
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 4; ++column)
                put<T>(offset + sizeof(T) * (4 * row + column), matrix[column][row]);
    }
    std::string bytes() && { return std::move(bytes_); }

 private:
    std::string bytes_;
};

// The names that the formats give to a type of samples.
struct TypeNames {
    int nifti;
    const char *nrrd, *meta_image, *vtk;
};

const TypeNames& names_of(ScalarType type) {
    static constexpr TypeNames names[] = {{2, "unsigned char", "MET_UCHAR", "unsigned_char"},
                                          {256, "signed char", "MET_CHAR", "char"},
                                          {512, "unsigned short", "MET_USHORT", "unsigned_short"},
                                          {4, "short", "MET_SHORT", "short"},
                                          {16, "float", "MET_FLOAT", "float"}};
    return names[static_cast<size_t>(type)];
}

glm::dmat4 ras_from_index(const Grid& grid) {
    glm::dmat4 flip(1);
    flip[0][0] = flip[1][1] = -1;
    return flip * grid.world_from_index;
}

// How far rounding the matrix to 32-bit floats moves a corner of the sampled box.
double moved_by_rounding_mm(const Grid& grid) {
    const glm::dmat4& exact = grid.world_from_index;
    const glm::dmat4 change = glm::dmat4(glm::mat4(exact)) - exact;
    double most = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 pick(corner & 1, corner >> 1 & 1, corner >> 2);
        const glm::dvec4 index(pick * (glm::dvec3(grid.size) - 1.0), 1);
        most = std::max(most, glm::length(glm::dvec3(change * index)));
    }
    return most;
}

struct Qform {
    int code = 0;
    double third_axis = 1; // -1 where it is turned round
    glm::dvec3 bcd{};
    glm::dvec3 offset{};
};

Qform qform_of(const Grid& grid) {
    Qform qform;
    if (shear(grid) > kSquare)
        return qform;
    const glm::dmat4 ras = ras_from_index(grid);
    glm::dmat3 rotation(ras);
    for (int axis = 0; axis < 3; ++axis)
        rotation[axis] = glm::normalize(rotation[axis]);
    if (glm::determinant(rotation) < 0) {
        rotation[2] = -rotation[2];
        qform.third_axis = -1;
    }
    const glm::dquat q = glm::quat_cast(rotation);
    const double sign = q.w < 0 ? -1 : 1;
    qform.code = 1;
    qform.bcd = sign * glm::dvec3(q.x, q.y, q.z);
    qform.offset = glm::dvec3(ras[3]);
    return qform;
}

std::string nifti_1(const Grid& grid, ScalarType type) {
    NiftiFields fields(352); // with the four zeros that say "no extensions"
    fields.put<int32_t>(0, 348);
    fields.put<int8_t>(38, 'r'); // "regular", as Analyze wanted it
    for (int i = 0; i < 8; ++i)
        fields.put<int16_t>(40 + 2 * i, i == 0 ? 3 : i <= 3 ? grid.size[i - 1] : 1);
    fields.put<int16_t>(70, names_of(type).nifti);
    fields.put<int16_t>(72, 8 * bytes_per_sample(type));
    const Qform qform = qform_of(grid);
    fields.put<float>(76, qform.third_axis);
    fields.put_vector<float>(80, spacing_mm(grid));
    fields.put<float>(108, 352);
    fields.put<float>(112, 1);  // slope
    fields.put<int8_t>(123, 2); // mm
    fields.put_text(148, "palpate");
    fields.put<int16_t>(252, qform.code);
    fields.put<int16_t>(254, 1); // sform: scanner coordinates
    fields.put_vector<float>(256, qform.bcd);
    fields.put_vector<float>(268, qform.offset);
    fields.put_rows<float>(280, ras_from_index(grid));
    fields.put_text(344, "n+1");
    return std::move(fields).bytes();
}

std::string nifti_2(const Grid& grid, ScalarType type) {
    NiftiFields fields(544);
    fields.put<int32_t>(0, 540);
    fields.put_text(4, std::string_view("n+2\0\r\n\x1a\n", 8));
    fields.put<int16_t>(12, names_of(type).nifti);
    fields.put<int16_t>(14, 8 * bytes_per_sample(type));
    for (int i = 0; i < 8; ++i)
        fields.put<int64_t>(16 + 8 * i, i == 0 ? 3 : i <= 3 ? grid.size[i - 1] : 1);
    const Qform qform = qform_of(grid);
    fields.put<double>(104, qform.third_axis);
    fields.put_vector<double>(112, spacing_mm(grid));
    fields.put<int64_t>(168, 544);
    fields.put<double>(176, 1); // slope
    fields.put_text(240, "palpate");
    fields.put<int32_t>(344, qform.code);
    fields.put<int32_t>(348, 1);
    fields.put_vector<double>(352, qform.bcd);
    fields.put_vector<double>(376, qform.offset);
    fields.put_rows<double>(400, ras_from_index(grid));
    fields.put<int32_t>(500, 2); // mm
    return std::move(fields).bytes();
}

// The shortest decimals that give the same doubles when read back.
std::string text_of(glm::dvec3 v, const char* between) {
    return fmt::format("{}{}{}{}{}", v.x, between, v.y, between, v.z);
}

std::string size_text(const Grid& grid) {
    return fmt::format("{} {} {}", grid.size.x, grid.size.y, grid.size.z);
}

} // namespace

VolumeHeader nifti_volume_header(const Grid& grid, ScalarType type) {
    const bool fits_version_1 = glm::all(glm::lessThanEqual(grid.size, glm::uvec3(INT16_MAX))) &&
                                moved_by_rounding_mm(grid) <= kMostMoved_mm;
    VolumeHeader header;
    header.bytes = fits_version_1 ? nifti_1(grid, type) : nifti_2(grid, type);
    return header;
}

VolumeHeader nrrd_volume_header(const Grid& grid, ScalarType type, const std::string& modality) {
    const glm::dmat4& m = grid.world_from_index;
    VolumeHeader header;
    header.packed = VolumeHeader::Packed::voxels;
    header.bytes = fmt::format(
        "NRRD0004\n"
        "type: {}\n"
        "dimension: 3\n"
        "space: left-posterior-superior\n"
        "sizes: {}\n"
        "space directions: ({}) ({}) ({})\n"
        "kinds: domain domain domain\n"
        "endian: little\n"
        "encoding: gzip\n"
        "space origin: ({})\n"
        "{}\n",
        names_of(type).nrrd, size_text(grid), text_of(glm::dvec3(m[0]), ","),
        text_of(glm::dvec3(m[1]), ","), text_of(glm::dvec3(m[2]), ","),
        text_of(glm::dvec3(m[3]), ","),
        modality.empty() ? "" : fmt::format("modality:={}\n", modality));
    return header;
}

Result<VolumeHeader> meta_image_volume_header(const std::string& name, const Grid& grid,
                                              ScalarType type, const std::string& data_file,
                                              const std::string& modality) {
    if (const double found = shear(grid); found > kSquare)
        return fail(
            "{}: MetaImage holds only axes at right angles, these have a cosine of {:.3g} "
            "between them; NIfTI and NRRD hold it",
            name, found);
    const glm::dmat3 unit = directions(grid);
    VolumeHeader header;
    header.bytes = fmt::format(
        "ObjectType = Image\n"
        "NDims = 3\n"
        "BinaryData = True\n"
        "BinaryDataByteOrderMSB = False\n"
        "CompressedData = False\n"
        "TransformMatrix = {} {} {}\n"
        "Offset = {}\n"
        "CenterOfRotation = 0 0 0\n"
        "ElementSpacing = {}\n"
        "DimSize = {}\n"
        "ElementType = {}\n"
        "{}ElementDataFile = {}\n",
        text_of(unit[0], " "), text_of(unit[1], " "), text_of(unit[2], " "),
        text_of(glm::dvec3(grid.world_from_index[3]), " "), text_of(spacing_mm(grid), " "),
        size_text(grid), names_of(type).meta_image,
        modality.empty() ? "" : fmt::format("Modality = MET_MOD_{}\n", modality), data_file);
    return header;
}

Result<VolumeHeader> vtk_volume_header(const std::string& name, const Grid& grid, ScalarType type) {
    const glm::dmat3 unit = directions(grid);
    for (int axis = 0; axis < 3; ++axis)
        if (!(unit[axis][axis] > 1 - kSquare))
            return fail(
                "{}: legacy VTK holds only axes towards left, posterior and superior, axis "
                "{} points to ({:.3g}, {:.3g}, {:.3g}); NIfTI, NRRD and MetaImage hold it",
                name, "xyz"[axis], unit[axis].x, unit[axis].y, unit[axis].z);
    VolumeHeader header;
    header.big_endian = true;
    header.bytes = fmt::format(
        "# vtk DataFile Version 3.0\n"
        "palpate\n"
        "BINARY\n"
        "DATASET STRUCTURED_POINTS\n"
        "DIMENSIONS {}\n"
        "ORIGIN {}\n"
        "SPACING {}\n"
        "POINT_DATA {}\n"
        "SCALARS values {} 1\n"
        "LOOKUP_TABLE default\n",
        size_text(grid), text_of(glm::dvec3(grid.world_from_index[3]), " "),
        text_of(spacing_mm(grid), " "), sample_count(grid), names_of(type).vtk);
    return header;
}

} // namespace palpate::io
