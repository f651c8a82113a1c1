#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "engine/mesh/mesh.h"
#include "engine/volume/volume.h"

namespace palpate::haptics {

struct TouchPlates; // touch_plates.h

// A tool as a point shell, in tool space: the points that swept-tool moves through a volume.
struct ToolPoints {
    std::vector<glm::dvec3> points_mm; // at most 4096 are used
};

// A mesh with a grid over it, so that the triangles about a place are found in the tick. Made
// before it is published, at most once a mesh.
struct TouchMesh {
    std::shared_ptr<const Mesh> mesh; // without shear or scale (rigid_space.h)
    glm::dmat4 mesh_from_world{1.0};
    glm::vec3 low_mm{0.0};
    float cell_mm = 1.0f;
    double grain_mm = 1.0; // what is smaller is passed over in a step
    glm::ivec3 cells{0};
    std::vector<uint32_t> first;       // of each cell's triangles; one more at the end
    std::vector<glm::uvec3> triangles; // in each cell that their boxes meet
    double bulge_mm = 0.0;             // TriangleSpan::bulge_mm
    // It is the surface of the volume that is felt: where that has no data, the mesh says nothing.
    // False for a mesh from elsewhere.
    bool is_of_samples = true;
};

// The data that can be felt: a value, published through a Mailbox and immutable afterwards. Data
// that a tick needs beside the samples (smoothed distances, bounds, a local surface) is computed
// before publishing and stored here.
struct TouchScene {
    std::optional<Volume> grey;                 // V of the papers: values, HU say
    std::optional<Volume> labels;               // S of the papers: whole numbers, 0 is free
    std::array<std::optional<Volume>, 3> field; // a vector field's x, y, z in world axes
    std::shared_ptr<const Mesh> mesh;
    std::shared_ptr<const TouchMesh> touch_mesh; // of swept-mesh
    std::shared_ptr<const ToolPoints> tool;      // of swept-tool; null is a sphere
    std::shared_ptr<const TouchPlates> plates;   // that can be pressed; null: none
    uint64_t version = 0;                        // rises with every publication
};

} // namespace palpate::haptics
