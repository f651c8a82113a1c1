#include "engine/decode/mgh_header.h"

#include "engine/decode/affine.h"
#include "engine/decode/header_fields.h"

namespace palpate::io {

namespace {

Result<ComponentType> component_type(const std::string& name, int32_t type) {
    constexpr TypeKey<int32_t> types[] = {{0, ComponentType::u8},
                                          {1, ComponentType::i32},
                                          {3, ComponentType::f32},
                                          {4, ComponentType::i16},
                                          {10, ComponentType::u16}};
    if (const auto found = find_type(types, type))
        return *found;
    return fail(
        "{}: expected voxels of the MGH types 0 (uchar), 1 (int), 3 (float), 4 (short) or 10 "
        "(ushort), found {}; mri_convert --out_data_type changes it",
        name, type);
}

} // namespace

Result<MghHeader> parse_mgh_header(const std::string& name, std::span<const std::byte> bytes) {
    if (bytes.size() < kMghHeaderBytes)
        return fail("{}: expected an MGH header of {} bytes, found {}", name, kMghHeaderBytes,
                    bytes.size());
    const HeaderFields fields(bytes, true);
    if (const auto version = fields.at<int32_t>(0); version != 1)
        return fail("{}: expected an MGH header that begins with its version 1, found {}", name,
                    version);
    MghHeader header;
    for (int i = 0; i < 4; ++i) {
        const auto count = fields.at<int32_t>(static_cast<size_t>(4 + 4 * i));
        if (count < 1)
            return fail("{}: expected a {} of 1 or more, found {}", name,
                        i < 3 ? fmt::format("size along {}", "xyz"[i]) : "number of frames", count);
        (i < 3 ? header.size[i] : header.frames) = static_cast<uint32_t>(count);
    }
    PALPATE_TRY(header.type, component_type(name, fields.at<int32_t>(20)));
    header.has_geometry = fields.at<int16_t>(28) > 0;
    if (!header.has_geometry)
        return header; // what follows is not set then
    header.spacing_mm = fields.vector<float>(30);
    for (int axis = 0; axis < 3; ++axis)
        header.directions[axis] = fields.vector<float>(static_cast<size_t>(42 + 12 * axis));
    header.center_mm = fields.vector<float>(78);
    return header;
}

Result<Grid> mgh_grid(const std::string& name, const MghHeader& header,
                      std::vector<std::string>& warnings) {
    if (!header.has_geometry)
        warnings.push_back(fmt::format(
            "{}: stores neither spacing nor position (good RAS flag 0); as FreeSurfer does, 1 x 1 "
            "x 1 mm and coronal slices are assumed, and left and right may be swapped",
            name));
    glm::dmat3 steps = header.directions;
    for (int axis = 0; axis < 3; ++axis)
        steps[axis] *= header.spacing_mm[axis];
    const glm::dvec3 origin = header.center_mm - steps * (glm::dvec3(header.size) * 0.5);
    return grid_from_columns(name, header.size, steps, origin, kRas);
}

} // namespace palpate::io
