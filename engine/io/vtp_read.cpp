#include <algorithm>
#include <array>
#include <cmath>
#include <pugixml.hpp>

#include "engine/io/byte_source.h"
#include "engine/io/mesh_formats.h"
#include "engine/io/text_header.h"
#include "engine/io/vtk_xml.h"

// VTK XML poly data: polygons and triangle strips of all pieces.
namespace palpate::io {

namespace {

// pugixml's memory for an element or attribute, beside the text itself.
constexpr uint64_t kNodeBytes = 96;

class VtpReader {
 public:
    VtpReader(const VtkXml& split, const VtkLayout& layout, const std::string& name,
              uint64_t limit_bytes)
        : split_(split), layout_(layout), name_(name), limit_bytes_(limit_bytes) {}

    Result<LoadedMesh> read(const pugi::xml_node& poly_data) {
        for (const pugi::xml_node& piece : poly_data.children("Piece"))
            PALPATE_TRY(read_piece(piece));
        Mesh& mesh = loaded_.mesh;
        if (mesh.normals.size() != world_.size())
            mesh.normals.clear();
        if (mesh.labels.size() != mesh.triangles.size())
            mesh.labels.clear();
        if (mesh.labels.empty() || mesh.outer_labels.size() != mesh.triangles.size())
            mesh.outer_labels.clear();
        if (passed_over_ > 0)
            loaded_.warnings.push_back(
                fmt::format("{}: {} points and lines are left out", name_, passed_over_));
        PALPATE_TRY(const std::string space, read_space(poly_data));
        PALPATE_TRY(place_in_world(loaded_, world_, space, name_));
        return std::move(loaded_);
    }

 private:
    using Numbers = std::vector<double>;

    // Takes memory from the limit before it is taken from the machine.
    Result<void> spend(uint64_t bytes) {
        if (bytes > limit_bytes_)
            return fail("{}: expected a mesh that fits the memory allowed, found a larger one",
                        name_);
        limit_bytes_ -= bytes;
        return {};
    }

    Result<uint64_t> count(const pugi::xml_node& piece, const char* key) const {
        const pugi::xml_attribute attribute = piece.attribute(key);
        if (!attribute)
            return 0;
        const std::optional<int64_t> value = parse_integer(attribute.value());
        if (!value || *value < 0 || *value > 0x7fffffff)
            return fail("{}: expected 0 to 2147483647 in {}, found \"{}\"", name_, key,
                        std::string_view(attribute.value()).substr(0, 40));
        return static_cast<uint64_t>(*value);
    }

    // The space that 3D Slicer states in the field data, as "SPACE=RAS"; empty where it states
    // none. Strings are arrays of bytes that end in 0.
    Result<std::string> read_space(const pugi::xml_node& poly_data) {
        const pugi::xml_node array =
            poly_data.child("FieldData").find_child_by_attribute("Array", "Name", "SPACE");
        if (!array || std::string_view(array.attribute("type").value()) != "String")
            return std::string();
        std::string space = "SPACE=";
        if (std::string_view(array.attribute("format").as_string("ascii")) == "ascii") {
            for (const std::string_view word : words_of(array.text().get()))
                if (const auto code = parse_integer(word); code && *code > 0 && *code < 128)
                    space.push_back(static_cast<char>(*code));
                else
                    break;
            return space;
        }
        PALPATE_TRY(const VtkSource source, source_of(array, "the space"));
        const Result<uint64_t> bytes = array_bytes(source, layout_);
        std::array<std::byte, 64> text{};
        Result<void> filled;
        if (bytes && *bytes <= text.size())
            filled = fill(source, layout_, std::span(text).first(*bytes));
        if (!bytes || !filled || *bytes > text.size())
            return fail("{}: its space: {}", name_,
                        !bytes    ? bytes.error().message
                        : !filled ? filled.error().message
                                  : fmt::format("expected a name of a few letters, found {} bytes",
                                                *bytes));
        for (const std::byte b : text) {
            if (b == std::byte{0})
                break;
            space.push_back(static_cast<char>(b));
        }
        return space;
    }

    // Finds the bytes of an array that is not text.
    Result<VtkSource> source_of(const pugi::xml_node& array, const std::string& what) const {
        const std::string_view format = array.attribute("format").as_string("ascii");
        if (format == "binary")
            return VtkSource{array.text().get(), true};
        if (format != "appended")
            return fail("{}: expected {} as ascii, binary or appended, found \"{}\"", name_, what,
                        format.substr(0, 40));
        const std::optional<int64_t> offset = parse_integer(array.attribute("offset").value());
        if (!offset || *offset < 0 || static_cast<uint64_t>(*offset) > split_.appended.size())
            return fail("{}: expected {} from a byte up to {} of the appended data, found \"{}\"",
                        name_, what, split_.appended.size(),
                        std::string_view(array.attribute("offset").value()).substr(0, 40));
        return VtkSource{split_.appended.substr(static_cast<size_t>(*offset)),
                         layout_.appended_base64};
    }

    // The numbers of an array, of which there must be `count`.
    Result<Numbers> numbers(const pugi::xml_node& array, uint64_t count, const std::string& what) {
        if (!array)
            return fail("{}: expected an array of {}, found none", name_, what);
        const std::string_view type_name = array.attribute("type").value();
        const std::optional<ComponentType> type = vtk_type(type_name);
        if (!type)
            return fail("{}: expected numbers for {}, found the type \"{}\"", name_, what,
                        type_name.substr(0, 40));
        const bool is_text =
            std::string_view(array.attribute("format").as_string("ascii")) == "ascii";
        VtkSource source{array.text().get(), true};
        if (!is_text) {
            PALPATE_TRY(source, source_of(array, what));
        }
        const size_t each = bytes_per_component(*type);
        const double most = is_text          ? (source.text.size() + 1) / 2.0 * double(each)
                            : layout_.packed ? kDeflateExpansion * double(source.most_bytes())
                                             : double(source.most_bytes());
        if (double(count) * double(each) > most)
            return fail("{}: expected {} numbers for {}, found at most {:.0f}", name_, count, what,
                        most / double(each));
        PALPATE_TRY(spend(count * (sizeof(double) + 2 * each)));
        std::vector<uint64_t> memory((count * each + 7) / 8); // aligned for every type
        const std::span<std::byte> bytes(reinterpret_cast<std::byte*>(memory.data()), count * each);
        Result<void> filled =
            is_text ? fill_from_text(source.text, *type, bytes) : fill(source, layout_, bytes);
        if (!filled)
            return fail("{}: its {}: {}", name_, what, filled.error().message);
        if (!is_text && layout_.big_endian)
            swap_bytes(bytes, each);
        Numbers result(count);
        visit_component(*type, [&](auto t) {
            using T = decltype(t);
            const T* const stored = reinterpret_cast<const T*>(bytes.data());
            for (uint64_t i = 0; i < count; ++i)
                result[i] = static_cast<double>(stored[i]);
        });
        limit_bytes_ += count * 2 * each;
        return result;
    }

    Result<void> expect_components(const pugi::xml_node& array, uint32_t expected,
                                   const char* what) const {
        const uint32_t found = array.attribute("NumberOfComponents").as_uint(1);
        if (array && found != expected)
            return fail("{}: expected {} with {} components, found {}", name_, what, expected,
                        found);
        return {};
    }

    Result<void> read_points(const pugi::xml_node& piece, uint64_t points) {
        const pugi::xml_node array = piece.child("Points").child("DataArray");
        PALPATE_TRY(expect_components(array, 3, "points"));
        PALPATE_TRY(spend(points * (sizeof(glm::dvec3) + 2 * sizeof(glm::vec3))));
        PALPATE_TRY(const Numbers found, numbers(array, 3 * points, "points"));
        for (uint64_t i = 0; i < points; ++i) {
            const glm::dvec3 p(found[3 * i], found[3 * i + 1], found[3 * i + 2]);
            if (!(std::abs(p.x) <= 1e12 && std::abs(p.y) <= 1e12 && std::abs(p.z) <= 1e12))
                return fail("{}: expected positions within 1e12 mm, found ({}, {}, {}) at point {}",
                            name_, p.x, p.y, p.z, i);
            world_.push_back(p);
        }
        const pugi::xml_node data = piece.child("PointData");
        const char* const called = data.attribute("Normals").as_string("Normals");
        const pugi::xml_node normals = data.find_child_by_attribute("DataArray", "Name", called);
        if (!normals)
            return {};
        PALPATE_TRY(expect_components(normals, 3, "normals"));
        PALPATE_TRY(const Numbers directions, numbers(normals, 3 * points, "normals"));
        for (uint64_t i = 0; i < points; ++i)
            loaded_.mesh.normals.push_back(
                unit_normal({directions[3 * i], directions[3 * i + 1], directions[3 * i + 2]}));
        return {};
    }

    // The labels of all cells of a piece; empty where there is no such array.
    Result<Numbers> labels(const pugi::xml_node& piece, const char* called, uint64_t cells) {
        const pugi::xml_node array =
            piece.child("CellData").find_child_by_attribute("DataArray", "Name", called);
        if (!array || array.attribute("NumberOfComponents").as_uint(1) != 1)
            return Numbers();
        Result<Numbers> found = numbers(array, cells, called);
        if (found)
            for (const double label : *found)
                if (!(label >= 0.0 && label <= 65535.0) || label != std::floor(label))
                    return fail("{}: expected labels 0 .. 65535, found {} in {}", name_, label,
                                called);
        return found;
    }

    struct Labels {
        Numbers inner, outer; // of the cells of a piece
    };

    // Polygons (cut into fans) or strips, of which cell 0 is cell `first_cell` of the piece.
    Result<void> read_cells(const pugi::xml_node& piece, const char* kind, uint64_t cells,
                            uint64_t first_cell, uint32_t first_point, const Labels& labels) {
        if (cells == 0)
            return {};
        const pugi::xml_node node = piece.child(kind);
        const std::string what = fmt::format("the offsets of {}", kind);
        PALPATE_TRY(
            const Numbers offsets,
            numbers(node.find_child_by_attribute("DataArray", "Name", "offsets"), cells, what));
        double before = 0;
        for (uint64_t cell = 0; cell < cells; ++cell) {
            const double corners = offsets[cell] - before;
            if (!(corners >= 3 && corners < 4e9) || corners != std::floor(corners))
                return fail("{}: expected 3 corners or more in cell {} of {}, found {}", name_,
                            cell, kind, corners);
            before = offsets[cell];
        }
        if (before > double(uint64_t{1} << 40))
            return fail("{}: expected at most 2^40 corners in {}, found {}", name_, kind, before);
        const auto all = static_cast<uint64_t>(before);
        PALPATE_TRY(const Numbers corners,
                    numbers(node.find_child_by_attribute("DataArray", "Name", "connectivity"), all,
                            fmt::format("the connectivity of {}", kind)));
        const uint64_t points = world_.size() - first_point;
        for (const double corner : corners)
            if (!(corner >= 0.0 && corner < double(points)) || corner != std::floor(corner))
                return fail("{}: expected points 0 .. {} in {}, found {}", name_,
                            static_cast<int64_t>(points) - 1, kind, corner);
        Mesh& mesh = loaded_.mesh;
        const uint64_t triangles = all - 2 * cells;
        PALPATE_TRY(spend(triangles * (sizeof(glm::uvec3) + 2 * sizeof(uint16_t))));
        mesh.triangles.reserve(mesh.triangles.size() + triangles);
        const bool strips = std::string_view(kind) == "Strips";
        uint64_t begin = 0;
        for (uint64_t cell = 0; cell < cells; ++cell) {
            const auto at = [&](uint64_t i) {
                return first_point + static_cast<uint32_t>(corners[begin + i]);
            };
            const uint64_t count = static_cast<uint64_t>(offsets[cell]) - begin;
            for (uint64_t i = 2; i < count; ++i) {
                if (!strips)
                    mesh.triangles.emplace_back(at(0), at(i - 1), at(i));
                else if (i % 2 == 0)
                    mesh.triangles.emplace_back(at(i - 2), at(i - 1), at(i));
                else
                    mesh.triangles.emplace_back(at(i - 1), at(i - 2), at(i));
                if (!labels.inner.empty())
                    mesh.labels.push_back(static_cast<uint16_t>(labels.inner[first_cell + cell]));
                if (!labels.outer.empty())
                    mesh.outer_labels.push_back(
                        static_cast<uint16_t>(labels.outer[first_cell + cell]));
            }
            begin += count;
        }
        return {};
    }

    Result<void> read_piece(const pugi::xml_node& piece) {
        uint64_t counts[5];
        constexpr const char* keys[] = {"NumberOfPoints", "NumberOfVerts", "NumberOfLines",
                                        "NumberOfPolys", "NumberOfStrips"};
        for (size_t i = 0; i < std::size(keys); ++i) {
            PALPATE_TRY(counts[i], count(piece, keys[i]));
        }
        const auto [points, verts, lines, polys, strips] = counts;
        const uint64_t first_point = world_.size();
        if (first_point + points > 0x7fffffff)
            return fail("{}: expected at most 2147483647 points, found more", name_);
        passed_over_ += verts + lines;
        if (points > 0)
            PALPATE_TRY(read_points(piece, points));
        // Data of cells come in this order.
        const uint64_t cells = verts + lines + polys + strips;
        Labels of_cells;
        for (const auto& [called, into] :
             {std::pair("label", &of_cells.inner), {"outer_label", &of_cells.outer}}) {
            PALPATE_TRY(*into, labels(piece, called, cells));
        }
        const auto first = static_cast<uint32_t>(first_point);
        Result<void> read = read_cells(piece, "Polys", polys, verts + lines, first, of_cells);
        return read ? read_cells(piece, "Strips", strips, verts + lines + polys, first, of_cells)
                    : read;
    }

    const VtkXml& split_;
    const VtkLayout layout_;
    const std::string& name_;
    uint64_t limit_bytes_; // what is left of it
    LoadedMesh loaded_;
    std::vector<glm::dvec3> world_;
    uint64_t passed_over_ = 0;
};

} // namespace

Result<LoadedMesh> parse_vtp(std::string_view text, const std::string& name, uint64_t limit_bytes) {
    const VtkXml split = split_appended(text);
    const auto marks = static_cast<uint64_t>(std::count_if(
        split.xml.begin(), split.xml.end(), [](char c) { return c == '<' || c == '='; }));
    const uint64_t needed = 2 * split.xml.size() + kNodeBytes * marks;
    if (needed > limit_bytes)
        return fail("{}: expected XML that fits {} bytes, as memory allows, found it to need {}",
                    name, limit_bytes, needed);
    pugi::xml_document document;
    PALPATE_TRY(const pugi::xml_node file, parse_vtk(name, split, "PolyData", "a mesh", document));
    const pugi::xml_node poly_data = file.child("PolyData");
    if (!poly_data.child("Piece"))
        return fail("{}: expected a mesh with a piece, found none", name);
    PALPATE_TRY(const VtkLayout layout, vtk_layout(name, file));
    return VtpReader(split, layout, name, limit_bytes - needed).read(poly_data);
}

} // namespace palpate::io
