#include <fstream>
#include <pugixml.hpp>

#include "engine/decode/affine.h"
#include "engine/decode/formats.h"
#include "engine/io/byte_source.h"
#include "engine/io/text_header.h"
#include "engine/io/vtk_xml.h"

// VTK XML image data, "XML File Formats" of the VTK User's Guide: one piece, its point scalars as
// text, base64 or appended bytes, packed by zlib or not.
namespace palpate::io {

namespace {

Result<std::vector<double>> numbers_of(const pugi::xml_node& node, const char* key, size_t count,
                                       std::vector<double> absent) {
    const pugi::xml_attribute attribute = node.attribute(key);
    if (!attribute)
        return absent;
    const auto numbers = parse_doubles(attribute.value());
    if (!numbers || numbers->size() != count)
        return fail("expected {} numbers in {}, found \"{}\"", count, key, attribute.value());
    return *numbers;
}

struct Header {
    Grid grid;
    ComponentType type{};
    uint32_t components = 1;
    VtkLayout layout;
    std::string format; // "ascii", "binary", "appended"
    std::string text;   // of the array, for the first two
    uint64_t offset = 0;
};

Result<void> take_grid(const std::string& name, const pugi::xml_node& image, Header& header) {
    const auto extent = numbers_of(image.child("Piece"), "Extent", 6, {});
    const auto origin = numbers_of(image, "Origin", 3, {0, 0, 0});
    const auto spacing = numbers_of(image, "Spacing", 3, {1, 1, 1});
    const auto turned = numbers_of(image, "Direction", 9, {1, 0, 0, 0, 1, 0, 0, 0, 1});
    for (const auto* numbers : {&extent, &origin, &spacing, &turned})
        if (!*numbers)
            return fail("{}: {}", name, numbers->error().message);
    if (extent->size() != 6)
        return fail("{}: has no piece with an extent", name);
    glm::uvec3 size;
    glm::dmat3 steps;
    glm::dvec3 first;
    for (int axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<size_t>(axis);
        const double samples = (*extent)[2 * i + 1] - (*extent)[2 * i] + 1;
        if (!(samples >= 1 && samples <= 0xffffffffu))
            return fail("{}: claims {} samples on an axis, expected at least 1", name, samples);
        size[axis] = static_cast<uint32_t>(samples);
        for (size_t row = 0; row < 3; ++row)
            steps[axis][static_cast<int>(row)] = (*turned)[3 * row + i] * (*spacing)[i];
        first[axis] = (*extent)[2 * i];
    }
    // Origin is where index (0, 0, 0) would lie; the piece begins at its extent.
    PALPATE_TRY(
        header.grid,
        grid_from_columns(name, size, steps,
                          glm::dvec3((*origin)[0], (*origin)[1], (*origin)[2]) + steps * first));
    return {};
}

Result<Header> parse(const std::string& name, const VtkXml& split) {
    pugi::xml_document document;
    PALPATE_TRY(const pugi::xml_node file,
                parse_vtk(name, split, "ImageData", "a volume", document));
    const pugi::xml_node image = file.child("ImageData");
    if (!image.child("Piece") || image.child("Piece").next_sibling("Piece"))
        return fail("{}: expected one piece", name);
    Header header;
    PALPATE_TRY(take_grid(name, image, header));

    const pugi::xml_node points = image.child("Piece").child("PointData");
    const std::string wanted = points.attribute("Scalars").value();
    pugi::xml_node array = points.find_child_by_attribute("DataArray", "Name", wanted.c_str());
    if (!array)
        array = points.child("DataArray");
    if (!array)
        return fail("{}: has no point scalars", name);
    const std::string type = array.attribute("type").value();
    const std::optional<ComponentType> known = vtk_type(type);
    if (!known)
        return fail("{}: its samples are of type {}, which is not read", name, type);
    header.type = *known;
    header.components = array.attribute("NumberOfComponents").as_uint(1);
    header.format = array.attribute("format").as_string("ascii");
    header.text = array.text().get();
    header.offset = array.attribute("offset").as_ullong(0);
    PALPATE_TRY(header.layout, vtk_layout(name, file));
    return header;
}

} // namespace

Result<Decoded> decode_vti(const DecodeRequest& request, VoxelSink& sink) {
    const std::string name = request.path.string();
    PALPATE_TRY(const uint64_t bytes, regular_file_bytes(request.path));
    PALPATE_TRY(sink.reserve(name, 4 * bytes));
    std::string text(bytes, '\0');
    std::ifstream in(request.path, std::ios::binary);
    in.read(text.data(), static_cast<std::streamsize>(text.size()));
    if (!in)
        return fail("{}: cannot be read whole", name);
    const VtkXml split = split_appended(text);
    PALPATE_TRY(const Header header, parse(name, split));

    Decoded decoded;
    PALPATE_TRY(choose_frame(request, 1, decoded.warnings));
    decoded.grid = header.grid;
    VoxelClaim claim;
    claim.size = header.grid.size;
    claim.type = header.type;
    claim.components = header.components;
    claim.source_bytes = bytes;
    claim.most_expansion = header.format == "ascii" ? 4.0
                           : header.layout.packed   ? kDeflateExpansion
                                                    : kRawExpansion;
    PALPATE_TRY(const std::span<std::byte> voxels, sink.allocate(name, claim));
    Result<void> filled;
    if (header.format == "ascii") {
        filled = fill_from_text(header.text, header.type, voxels);
    } else if (header.format == "appended") {
        if (header.offset > split.appended.size())
            return fail("{}: its data begin at byte {} of {}", name, header.offset,
                        split.appended.size());
        filled = fill({split.appended.substr(header.offset), header.layout.appended_base64},
                      header.layout, voxels);
    } else {
        filled = fill({header.text, true}, header.layout, voxels);
    }
    if (!filled)
        return fail("{}: {}", name, filled.error().message);
    if (header.layout.big_endian && header.format != "ascii")
        swap_bytes(voxels, bytes_per_component(header.type));
    decoded.notes.push_back(name +
                            ": VTK files name no patient axes; x, y, z are taken as left, "
                            "posterior, superior");
    return decoded;
}

} // namespace palpate::io
