#include "apps/view/document/hand_tool.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "engine/base/assert.h"
#include "engine/edit/stroke.h"
#include "engine/surface/marching_cubes.h"
#include "engine/volume/builder.h"
#include "engine/volume/extent.h"

namespace palpate::view {

Json shape_json(TipShape shape, double radius_mm) {
    switch (shape) {
        case TipShape::ball:
            break;
        case TipShape::box: {
            const double side = 2.0 * radius_mm;
            return {{"kind", "box"}, {"size_mm", Json::array({side, side, side})}};
        }
        case TipShape::cylinder:
            return {{"kind", "cylinder"}, {"radius_mm", radius_mm}, {"length_mm", 4.0 * radius_mm}};
        case TipShape::burr:
            return {{"kind", "burr"}, {"radius_mm", radius_mm}, {"flutes", 6}};
    }
    return {{"kind", "ball"}, {"radius_mm", radius_mm}};
}

// Less than a layer along any axis of the samples, so that a disc on a layer reaches no other one.
double disc_thickness_mm(const Grid& grid) {
    return 0.5 * smallest_spacing_mm(grid);
}

ToolPose pose_of_disc(glm::dvec3 at_mm, glm::dvec3 across, const Grid& grid) {
    const glm::dvec3 a = glm::abs(across);
    const glm::dvec3 other = a.x <= a.y && a.x <= a.z ? glm::dvec3(1, 0, 0)
                             : a.y <= a.z             ? glm::dvec3(0, 1, 0)
                                                      : glm::dvec3(0, 0, 1);
    const glm::dvec3 u = glm::normalize(glm::cross(other, across)), v = glm::cross(across, u);
    return {at_mm - 0.5 * disc_thickness_mm(grid) * across,
            glm::quat_cast(glm::dmat3(u, v, across))};
}

palpate::Tool tool_of(const Json& shape) {
    JsonErrors errors{"shape", {}};
    palpate::Tool tool = read_tool(JsonValue(shape, "", errors));
    PALPATE_ASSERT(!errors.first);
    return tool;
}

bool ToolRack::hold(Session& session, EditSetup setup, uint8_t tool) {
    Held wanted{setup.shape, setup.operation, setup.on, setup.guide, session.parameters().iso};
    if (held_[tool] == wanted)
        return true;
    if (!session.use(std::move(setup), tool))
        return false;
    held_[tool] = std::move(wanted);
    return true;
}

void ToolRack::lay_down(Session& session, uint8_t tool) {
    held_[tool].reset();
    session.lay_down(tool);
}

std::shared_ptr<const Mesh> TipMesh::at(TipShape shape, double radius_mm, const ToolPose& pose) {
    if (mesh_.positions.empty() || shape != shape_ || radius_mm != radius_mm_) {
        shape_ = shape;
        radius_mm_ = radius_mm;
        const palpate::Tool tool = tool_of(shape_json(shape, radius_mm));
        const BoxMm box = tool.shape->bounds();
        constexpr double kCells = 20.0; // across the shape's shortest side
        const glm::dvec3 size = box.high - box.low;
        const double cell = std::min({size.x, size.y, size.z}) / kCells;
        const glm::uvec3 samples(glm::ceil(size / cell) + 5.0);
        const Grid grid = make_grid(samples, glm::dvec3(cell), box.low - 2.0 * cell);
        mesh_ = marching_cubes(
            make_volume(grid, ScalarType::f32,
                        [&](glm::uvec3 i) {
                            return -tool.shape->signed_mm(world_point(grid, glm::dvec3(i)));
                        }),
            0.0f);
        mesh_.world_from_mesh = world_from_mesh(grid);
        placed_.reset();
    }
    if (placed_ && glm::distance(pose.position_mm, pose_.position_mm) <= kStill_mm &&
        std::abs(glm::dot(pose.rotation, pose_.rotation)) > 1.0 - 1e-7)
        return placed_;
    pose_ = pose;
    auto placed = std::make_shared<Mesh>(mesh_);
    placed->world_from_mesh = glm::translate(glm::dmat4(1.0), pose.position_mm) *
                              glm::mat4_cast(pose.rotation) * mesh_.world_from_mesh;
    return placed_ = std::move(placed);
}

} // namespace palpate::view
