#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "engine/mesh/mesh.h"
#include "engine/segment/task.h"

// Deformable simplex meshes (Delingette, "Simplex meshes: a general representation for 3D shape
// reconstruction", 1994; "General object reconstruction based on simplex meshes", 1999).
namespace palpate {

// A closed surface on which every vertex has three neighbours: the dual of a triangulation. World
// millimetres. Steps move vertices and nothing else, so its topology stays.
struct SimplexMesh {
    std::vector<glm::dvec3> positions;
    std::vector<glm::dvec3> before;     // positions a step ago
    std::vector<glm::uvec3> neighbours; // counter-clockwise seen from outside
    // Face f has the vertices face_vertices[face_first[f]] .. [face_first[f + 1] - 1],
    // counter-clockwise seen from outside.
    std::vector<uint32_t> face_first, face_vertices;

    size_t faces() const { return face_first.size() - 1; }
};

// The dual of a triangulation: a vertex at the centre of each triangle, a face for each vertex.
// Refused: a mesh that is not closed, manifold and consistently oriented, or has no triangles.
Result<SimplexMesh> simplex_mesh(const Mesh& triangles);

// An ellipsoid along the world's axes, 20 * 4^subdivisions vertices; subdivisions <= 8.
SimplexMesh simplex_ellipsoid(glm::dvec3 center_mm, glm::dvec3 semi_axes_mm, int subdivisions);

// Each face as a fan of triangles about the mean of its vertices; its positions are the vertices,
// then the faces' centres. Mesh space is world, less an offset that world_from_mesh holds.
Mesh triangles_of(const SimplexMesh& mesh);

// V - E + F: 2 for a ball.
int64_t euler_number(const SimplexMesh& mesh);

// Outward unit normal of the plane through a vertex's neighbours; 0 where these lie on a line.
glm::dvec3 normal_at(const SimplexMesh& mesh, size_t vertex);

// The mean curvature at a vertex in 1/mm: of the sphere through it and its neighbours, positive
// where the surface is convex. sin(simplex angle) = curvature * radius of the neighbours' circle.
double curvature_at(const SimplexMesh& mesh, size_t vertex);

// A force pulls vertices, in mm: where each would go by itself. Writes a pull for each place;
// called with some vertices at a time, from all threads.
struct SimplexPlace {
    glm::dvec3 position_mm, normal;
};
using SimplexForce =
    std::function<void(std::span<const SimplexPlace> places, std::span<glm::dvec3> pulls_mm)>;

// To the surface where a signed distance d (mm, negative inside: signed_distance()) is 0, along the
// normal: -d (g . N) N, with g the gradient of d. So a part of the mesh that is turned over is
// drawn to the surface too, and not away from it, as -d N would. No force where it has no data.
// Keeps the volume.
SimplexForce toward_surface(const Volume& signed_distance);

// To the strongest change of the grey values along the normal, within `range_mm` on both sides, in
// steps of half the smallest spacing; of equal ones the nearest. Keeps the volume.
SimplexForce toward_edges(const Volume& volume, double range_mm);

// A person's pull: every vertex of the faces is drawn by this, in mm.
struct SimplexPull {
    std::vector<uint32_t> faces;
    glm::dvec3 by_mm;
};
// The faces at most `depth` faces away from one of them, rising; to choose a patch.
std::vector<uint32_t> patch_of_faces(const SimplexMesh& mesh, uint32_t face, uint32_t depth);

struct SimplexOptions {
    double mass = 1.0;     // >= 1
    double damping = 0.35; // share of the velocity that a step takes away, 0 .. 1
    double internal = 0.5; // of the internal force that a step follows, 0 .. 1
    double external = 0.2; // likewise of the external force, 0 .. 1
    // How far curvature is evened out: each vertex aims at the mean curvature of its neighbourhood,
    // made by this many passes of a mean over it and its neighbours. 0: its own, which keeps the
    // shape and spreads vertices evenly; more is more rigid.
    uint32_t rigidity = 4;
    double largest_step = 0.3; // of the mean distance to its neighbours, for forces of every kind
};

// One step of Newton's law with damping, of all vertices at once (Jacobi):
//
//   P(t+1) = P(t) + (1 - damping) (P(t) - P(t-1)) + (internal F + external E + pull) / mass
//
// The internal force F draws a vertex to the place over the centre of its neighbours at which the
// sphere through it has the curvature aimed at: with r the radius of the neighbours' circle, d the
// distance of their centre from its middle and H the curvature, at the height
// H (r^2 - d^2) / (sqrt(1 - d^2 H^2) + sqrt(1 - r^2 H^2)), |H| at most 1 / max(r, d). Every
// external force, and each step, is cut at largest_step. Where the neighbours lie on a line, only
// their middle draws. Forces are computed in float relative to each vertex, so that they are exact
// to 1e-6 of its distance from its neighbours. Returns the largest movement, mm.
double simplex_step(SimplexMesh& mesh, const SimplexForce& force,
                    std::span<const SimplexPull> pulls, const SimplexOptions& options);

// The samples whose centres lie inside triangles_of(mesh) get `label`, others 0: u8, or u16 for
// labels above 255. Exact for the mesh's own numbers: a sample on the surface belongs to one side
// of it, whichever faces meet there. Inside is where the surface winds round a sample.
Result<Volume> rasterised(const SimplexMesh& mesh, const Grid& grid, uint16_t label,
                          const Task& task);

} // namespace palpate
