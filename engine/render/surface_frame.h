#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "engine/render/scene_surface.h"
#include "engine/scene/scene.h"
#include "shaders/shared/surface.h"

namespace palpate {

// The part of a SurfaceFrame that does not depend on the camera, for one surface.
struct SurfaceFrameMesh {
    glm::dmat4 world_from_mesh;
    uint32_t first_style, style_count;
    uint32_t flags; // but for kSurfaceMirrored
};

// A scene's surfaces and clip planes as one eye sees them. Which pixels are drawn, and what lies
// behind them, is the caller's.
gpu::SurfaceFrame surface_frame(const View& view, uint32_t eye, const Scene& scene,
                                std::span<const SurfaceFrameMesh> meshes);

// The blocks of a surface that are not wholly behind the eye, those whose boxes' middles are
// nearest first.
std::vector<gpu::SurfaceBlock> nearest_first(const View& view, const glm::dmat4& world_from_mesh,
                                             std::span<const SurfacePart> parts);

// Blocks that are searched and drawn at a time: the first, and how many.
struct SurfaceBatch {
    uint32_t first, count;
};
std::vector<SurfaceBatch> batches_of(std::span<const gpu::SurfaceBlock> blocks);

} // namespace palpate
