#pragma once

#include "haptics/proxy/algorithm.h"
#include "haptics/proxy/triangles.h"

namespace palpate::haptics {

// A mesh with a grid over it, so that the triangles about a place are found in the tick. Made
// before it is published, at most once a mesh.
struct TouchMesh {
    std::shared_ptr<const Mesh> mesh;
    glm::dmat4 mesh_from_world{1.0};
    glm::vec3 low_mm{0.0};
    float cell_mm = 1.0f;
    glm::ivec3 cells{0};
    std::vector<uint32_t> first; // of each cell's triangles in `which`; one more at the end
    std::vector<uint32_t> which;
};
// Cells of about `cell_mm`, larger where there would be more than 2^22. Not for the servo thread.
std::shared_ptr<const TouchMesh> make_touch_mesh(std::shared_ptr<const Mesh> mesh, double cell_mm);

// Where a point moved towards `goal` comes to rest among triangles: swept from triangle to triangle
// (front sides alone hold), on each slid along up to three planes at once (planes.h), until it
// moves by less than 1e-7 mm. It stays up to 1e-4 mm off the faces, and never goes but where the
// way is free.
struct Rest {
    glm::dvec3 point{0.0};
    glm::dvec3 face_normal{0.0}, shaded_normal{0.0};
    bool touching = false, reached_side = false;
    uint32_t iterations = 0;
};
// Triangles are known within the box only; at its side the point stops and `reached_side` is set.
Rest come_to_rest(const TriangleSpan& surface, glm::dvec3 from, glm::dvec3 goal, glm::dvec3 low,
                  glm::dvec3 high);

// A point held out of scene.touch_mesh, whatever its speed, with force shading: the god-object of
// Zilles & Salisbury with all constraints of a tick solved within it. Friction, yielding and
// exchange of the mesh as in swept_point.h.
std::unique_ptr<Algorithm> make_swept_mesh();

// The same on the marching-cubes surface of the 9x9x9 samples about the proxy, made anew in the
// tick and along the way: the repair of Koerner et al. There is no rim to reach, so nothing is
// shifted, and edits and transfer functions are felt in the tick that sees them.
std::unique_ptr<Algorithm> make_swept_local();

} // namespace palpate::haptics
