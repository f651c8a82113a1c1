#pragma once

#include <optional>
#include <vector>

#include <pugixml.hpp>

#include "engine/base/error.h"
#include "engine/mesh/mesh.h"

namespace palpate::io {

// Numbers of an attribute, apart by white space or commas; nothing where a word is none.
std::optional<std::vector<double>> x3d_numbers(const pugi::xml_node& node, const char* attribute);

// The corners and faces of one X3D geometry node, in its own metres.
struct X3dGeometry {
    std::vector<glm::dvec3> points;
    std::vector<glm::uvec3> triangles; // counter-clockwise seen from outside
};
// Whether a node's name is one of a geometry that is read.
bool is_x3d_geometry(std::string_view name);
// A sentence where the node is wrong. `coordinates`: of its Coordinate node, or null.
Result<X3dGeometry> x3d_geometry(const pugi::xml_node& node, const pugi::xml_node& coordinates);

} // namespace palpate::io
