#pragma once

#include <cstdint>
#include <stop_token>

#include "engine/mesh/mesh.h"
#include "engine/mesh/triangle_tree.h"
#include "engine/volume/synthetic.h"

namespace palpate {

struct DistanceOptions {
    double tolerance_mm = 1e-3; // > 0: true largest distance minus the reported one, at most
    uint32_t samples = 100'000; // about as many points, spread evenly by area, for mean and angle
    std::stop_token stop;       // after a stop request the result is invalid (too small)
};

// How far the points of one surface are from another. World millimetres; all 0 for an empty mesh,
// infinite where the other surface is empty.
struct SurfaceDistance {
    double largest_mm = 0.0; // of all points, not of vertices alone: the true largest is at most
                             // tolerance_mm more
    double mean_mm = 0.0;    // over the area
    double rms_mm = 0.0;
    double normal_rms_deg = 0.0; // angle between the normals at a point and at the point nearest it
    double normal_max_deg = 0.0;
    uint64_t samples = 0;
};

// From every point of `from` to the nearest point of `to`.
//
// The largest distance is found by cutting triangles, along the other surface's sides and in four,
// until each piece is proven not to matter: the distance to one triangle is a convex function, so
// over a piece it is largest at a corner (Guthe, Borodin & Klein, "Fast and accurate Hausdorff
// distance calculation between meshes", 2005). Mean and angle are taken at the centres of equal
// parts of every triangle.
SurfaceDistance distance_to_mesh(const TriangleTree& from, const TriangleTree& to,
                                 const DistanceOptions& options = {});

// Both ways. The Hausdorff distance is the larger `largest_mm`.
struct MeshDistance {
    SurfaceDistance forward, backward; // first to second, second to first
    double hausdorff_mm() const;
    double rms_mm() const; // of the points of both
};
MeshDistance compare_meshes(const Mesh& first, const Mesh& second,
                            const DistanceOptions& options = {});

// From a mesh to the surface on which a field has the value `iso`; outside is where values are
// lower. Distances are to a point found on that surface by Newton steps along the gradient and then
// along the surface, so they are never too small, and exact where the nearest point is unique.
struct FieldDistance {
    SurfaceDistance surface;        // at samples (largest_mm too: no point between them is proven)
    double vertex_largest_mm = 0.0; // at the mesh's positions that triangles use
    double vertex_rms_mm = 0.0;
    double vertex_normal_max_deg = 0.0; // of the mesh's own normals; 0 where it has none
    uint64_t lost = 0; // points from which no surface was found; they count in nothing else
};
FieldDistance distance_to_field(const Mesh& mesh, const synthetic::Field& field, double iso,
                                const DistanceOptions& options = {});

} // namespace palpate
