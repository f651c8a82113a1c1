#include "engine/io/x3d_shapes.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "engine/io/mesh_formats.h"

namespace palpate::io {

namespace {

constexpr uint32_t kAround = 32, kDown = 16; // facets of round shapes

double number_of(const pugi::xml_node& node, const char* attribute, double otherwise) {
    const auto numbers = x3d_numbers(node, attribute);
    return numbers && numbers->size() == 1 ? numbers->front() : otherwise;
}

bool is_false(const pugi::xml_node& node, const char* attribute) {
    return std::string_view(node.attribute(attribute).value()) == "false";
}

X3dGeometry box(const pugi::xml_node& node) {
    glm::dvec3 half(1.0);
    if (const auto size = x3d_numbers(node, "size"); size && size->size() == 3)
        half = 0.5 * glm::dvec3((*size)[0], (*size)[1], (*size)[2]);
    X3dGeometry made;
    for (uint32_t corner = 0; corner < 8; ++corner)
        made.points.push_back(half * glm::dvec3(corner & 1 ? 1.0 : -1.0, corner & 2 ? 1.0 : -1.0,
                                                corner & 4 ? 1.0 : -1.0));
    constexpr uint32_t faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                      {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& f : faces) {
        made.triangles.emplace_back(f[0], f[1], f[2]);
        made.triangles.emplace_back(f[0], f[2], f[3]);
    }
    return made;
}

// A closed surface of revolution about y: rings of kAround points from the top down, between two
// points on the axis.
X3dGeometry turned_profile(const std::vector<glm::dvec2>& rings, double top, double bottom) {
    X3dGeometry made;
    made.points.emplace_back(0.0, top, 0.0);
    for (const glm::dvec2 ring : rings) // radius, y
        for (uint32_t i = 0; i < kAround; ++i) {
            const double angle = 2.0 * M_PI * i / kAround;
            made.points.emplace_back(ring.x * std::sin(angle), ring.y, ring.x * std::cos(angle));
        }
    made.points.emplace_back(0.0, bottom, 0.0);
    const auto last = static_cast<uint32_t>(made.points.size() - 1);
    const auto count = static_cast<uint32_t>(rings.size());
    for (uint32_t i = 0; i < kAround; ++i) {
        const uint32_t next = (i + 1) % kAround;
        made.triangles.emplace_back(0, 1 + i, 1 + next);
        for (uint32_t r = 0; r + 1 < count; ++r) {
            const uint32_t a = 1 + r * kAround, b = a + kAround;
            made.triangles.emplace_back(a + i, b + i, b + next);
            made.triangles.emplace_back(a + i, b + next, a + next);
        }
        const uint32_t a = 1 + (count - 1) * kAround;
        made.triangles.emplace_back(last, a + next, a + i);
    }
    return made;
}

X3dGeometry sphere(double radius) {
    std::vector<glm::dvec2> rings;
    for (uint32_t r = 1; r < kDown; ++r) {
        const double angle = M_PI * r / kDown;
        rings.emplace_back(radius * std::sin(angle), radius * std::cos(angle));
    }
    return turned_profile(rings, radius, -radius);
}

// Faces of indices, each ended by -1 where `by_minus_one`, else in threes.
Result<X3dGeometry> faces(const pugi::xml_node& node, const pugi::xml_node& coordinates,
                          const char* attribute, bool by_minus_one) {
    const auto place = x3d_numbers(coordinates, "point");
    const auto index = x3d_numbers(node, attribute);
    if (!coordinates || !place || place->size() % 3 != 0)
        return fail("{}: expected a Coordinate with points of three numbers, found {}", node.name(),
                    !coordinates ? "none"
                    : !place     ? "words"
                                 : "others");
    if (!index)
        return fail("{}: expected {} of whole numbers", node.name(), attribute);
    X3dGeometry made;
    for (size_t i = 0; i < place->size(); i += 3)
        made.points.emplace_back((*place)[i], (*place)[i + 1], (*place)[i + 2]);
    std::vector<uint32_t> face;
    const auto end_face = [&] {
        for (size_t k = 2; k < face.size(); ++k)
            made.triangles.emplace_back(face[0], face[k - 1], face[k]);
        face.clear();
    };
    for (const double number : *index) {
        if (by_minus_one && number == -1.0) {
            end_face();
            continue;
        }
        if (!(number >= 0.0 && number < static_cast<double>(made.points.size())) ||
            number != std::floor(number))
            return fail("{}: expected {} of 0 .. {}, found {:g}", node.name(), attribute,
                        made.points.size() - 1, number);
        face.push_back(static_cast<uint32_t>(number));
        if (!by_minus_one && face.size() == 3)
            end_face();
    }
    if (by_minus_one)
        end_face(); // the last one needs no -1
    else if (!face.empty())
        return fail("{}: expected {} in threes, found {}", node.name(), attribute, index->size());
    if (is_false(node, "ccw"))
        for (glm::uvec3& triangle : made.triangles)
            std::swap(triangle.y, triangle.z);
    return made;
}

} // namespace

std::optional<std::vector<double>> x3d_numbers(const pugi::xml_node& node, const char* attribute) {
    std::string text = node.attribute(attribute).value();
    std::replace(text.begin(), text.end(), ',', ' ');
    Words words(text);
    std::vector<double> numbers;
    while (words.rest().find_first_not_of(" \t\r\n\v\f") != std::string_view::npos) {
        const std::optional<double> number = words.number();
        if (!number || !std::isfinite(*number))
            return std::nullopt;
        numbers.push_back(*number);
    }
    return numbers;
}

bool is_x3d_geometry(std::string_view name) {
    for (const char* known :
         {"IndexedFaceSet", "IndexedTriangleSet", "Box", "Sphere", "Cylinder", "Cone"})
        if (name == known)
            return true;
    return false;
}

Result<X3dGeometry> x3d_geometry(const pugi::xml_node& node, const pugi::xml_node& coordinates) {
    const std::string_view name = node.name();
    if (name == "Box")
        return box(node);
    if (name == "Sphere")
        return sphere(number_of(node, "radius", 1.0));
    if (name == "Cylinder") {
        const double radius = number_of(node, "radius", 1.0);
        const double half = 0.5 * number_of(node, "height", 2.0);
        return turned_profile({{radius, half}, {radius, -half}}, half, -half);
    }
    if (name == "Cone") {
        const double half = 0.5 * number_of(node, "height", 2.0);
        return turned_profile({{number_of(node, "bottomRadius", 1.0), -half}}, half, -half);
    }
    if (name == "IndexedTriangleSet")
        return faces(node, coordinates, "index", false);
    return faces(node, coordinates, "coordIndex", true);
}

} // namespace palpate::io
