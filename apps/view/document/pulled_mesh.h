#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "engine/scene/camera.h"
#include "engine/segment/simplex_mesh.h"

namespace palpate::view {

// The deformable mesh of an object whose faces a person pulls, between its making from a label and
// its end as one. Equal calls give equal meshes.
class PulledMesh {
 public:
    PulledMesh(SimplexMesh mesh, uint16_t label);

    const SimplexMesh& mesh() const { return mesh_; }
    uint16_t label() const { return label_; }
    // Its triangles (triangles_of()); another object after each change.
    const std::shared_ptr<const Mesh>& surface() const { return surface_; }

    // The first point in which a ray meets it.
    std::optional<glm::dvec3> met(const Ray& ray) const;
    // The nearest middle of a face, at most so far away.
    std::optional<glm::dvec3> near(glm::dvec3 point_mm, double within_mm) const;
    // Its cut with a plane: the ends of pieces, mm.
    std::vector<std::pair<glm::dvec3, glm::dvec3>> cut(glm::dvec3 point_mm,
                                                       glm::dvec3 normal) const;

    // Takes the face that is nearest to a point and those at most `reach` faces away.
    void hold(glm::dvec3 point_mm, uint32_t reach);
    // Steps until what was held at the point lies at the goal, at most kMostSteps of them: the
    // patch is drawn there, and the mesh's internal force takes what is round it along.
    static constexpr int kMostSteps = 60;
    void pull(glm::dvec3 goal_mm);
    void let_go(bool keep); // false: it is again as it was before hold()

    // Whether a pull has moved it that was kept, since it was made or since mark_applied().
    bool is_pulled() const { return is_pulled_; }
    void mark_applied() { is_pulled_ = false; }

 private:
    glm::dvec3 middle_of(uint32_t face) const;
    uint32_t nearest_face(glm::dvec3 point_mm) const;
    void show();

    SimplexMesh mesh_;
    uint16_t label_;
    bool is_pulled_ = false;
    std::shared_ptr<const Mesh> surface_;
    struct Held {
        SimplexPull patch;
        uint32_t face;
        glm::dvec3 beside_mm;              // the point that was held, from the face's middle
        std::vector<glm::dvec3> positions; // before
        std::vector<bool> stays;           // vertices that are too far away to be bent
    };
    std::optional<Held> held_;
};

} // namespace palpate::view
