#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "apps/view/tools/stylus.h"
#include "engine/mesh/mesh.h"
#include "engine/session/session.h"

namespace palpate::view {

// The shape of a tool, as a step of the document has it, and the tool of such a shape.
Json shape_json(TipShape shape, double radius_mm);
palpate::Tool tool_of(const Json& shape);

// The pose of a disc about a point, across a direction: a cylinder begins at its tool's origin.
double disc_thickness_mm(const Grid& grid);
ToolPose pose_of_disc(glm::dvec3 at_mm, glm::dvec3 across, const Grid& grid);

// The tools that a session has been given: gives it one where it differs from what it has.
class ToolRack {
 public:
    // False: too many commands at once; try again.
    bool hold(Session& session, EditSetup setup, uint8_t tool = 0);
    void lay_down(Session& session, uint8_t tool);

 private:
    struct Held {
        Json shape;
        Operation operation;
        std::string on, guide;
        double iso = 0.0; // smooth walls take it (Session::use())
        friend bool operator==(const Held&, const Held&) = default;
    };
    std::array<std::optional<Held>, Editor::kTools> held_;
};

// The tool's surface, in its own space, to be placed by Mesh::world_from_mesh. The same object as
// long as shape and radius are the same and the tool has not moved by more than kStill_mm.
class TipMesh {
 public:
    static constexpr double kStill_mm = 0.02;
    std::shared_ptr<const Mesh> at(TipShape shape, double radius_mm, const ToolPose& pose);

 private:
    TipShape shape_ = TipShape::ball;
    double radius_mm_ = 0.0;
    Mesh mesh_;
    ToolPose pose_;
    std::shared_ptr<const Mesh> placed_;
};

} // namespace palpate::view
