#pragma once

#include <glm/glm.hpp>
#include <optional>

#include "engine/render/changed_pixels.h"
#include "engine/scene/scene.h"

namespace palpate {

// A box along the axes of a space of its own; low <= high.
struct AxisBox {
    glm::dvec3 low{}, high{};
};

// The box of a mesh in its own space; none: it has no vertices.
std::optional<AxisBox> box_of(const Mesh& mesh);

// The part of a picture that a box covers, from the upper left corner; the picture is 0 .. 1.
struct SeenBox {
    glm::dvec2 low{}, high{};
};
// None where a part of the box is not in front of the eye.
std::optional<SeenBox> seen_box(const View& view, const glm::dmat4& world_from_box,
                                const AxisBox& box);

// The pixels of a picture in which a box may be seen, and one beyond for rounding.
std::optional<PixelBox> seen_pixels_of(const View& view, const glm::dmat4& world_from_box,
                                       const AxisBox& box, glm::uvec2 size_px);

// The pixels in which a mesh may be seen, in either eye.
PixelBox pixels_of(const Scene& scene, const Mesh& mesh);

} // namespace palpate
