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

namespace {

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

palpate::Tool tool_of(const Json& shape) {
    JsonErrors errors{"shape", {}};
    palpate::Tool tool = read_tool(JsonValue(shape, "", errors));
    PALPATE_ASSERT(!errors.first);
    return tool;
}

OperationKind kind_of(Carve carve) {
    switch (carve) {
        case Carve::erase:
            return OperationKind::erase;
        case Carve::erode:
            return OperationKind::erode;
        case Carve::dilate:
            return OperationKind::dilate;
        case Carve::smooth:
            return OperationKind::smooth;
        case Carve::cut:
            return OperationKind::cut;
        case Carve::drill:
        case Carve::add:
            return OperationKind::mill;
        case Carve::nothing:
        case Carve::draw:
        case Carve::seed:
        case Carve::pull:
        case Carve::crosshair:
            break;
    }
    return OperationKind::draw;
}

} // namespace

EditSetup make_tool(Carve carve, TipShape shape, double radius_mm, uint16_t label,
                    double rate_per_s, const ToolFor& made_for) {
    const bool on_labels = is_on_labels(carve);
    Json json = shape_json(shape, radius_mm);
    if (on_labels && radius_mm < largest_spacing_mm(made_for.grid))
        json = Json{{"kind", "union"}, {"of", Json::array({json, {{"kind", "point"}}})}};
    EditSetup setup{json, tool_of(json), {}, on_labels ? made_for.labels : made_for.grey, {}};
    Operation& operation = setup.operation;
    operation.kind = kind_of(carve);
    operation.label = label;
    if (carve == Carve::smooth)
        operation.radius_mm = std::max(radius_mm, largest_spacing_mm(made_for.grid));
    if (carve == Carve::drill || carve == Carve::add) {
        const double range = std::max(1e-6, double{made_for.range.max} - made_for.range.min);
        operation.rates = {{0.0, rate_per_s * range}};
        operation.falloff_mm = 0.5 * smallest_spacing_mm(made_for.grid);
    }
    if (carve == Carve::add) // well into the values that are solid
        operation.to_value = std::round(0.5 * (made_for.iso + made_for.range.max));
    return setup;
}

bool ToolRack::hold(Session& session, EditSetup setup, uint8_t tool) {
    Held wanted{setup.shape, setup.operation, setup.on, session.parameters().iso};
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
