#pragma once

#include <vector>

#include "engine/render/cell_map.h"
#include "engine/render/gpu_volume.h"
#include "engine/scene/scene.h"
#include "shaders/shared/atlas.h"

// What a scene needs of a volume that lies in an atlas.
namespace palpate {

// How far from a visible sample the march of a layer may read others, in samples: the neighbours
// that gradients are taken from, or the other end of a segment. Steps are up to step_factor times
// as long as the layer's.
double reach_samples(const RayCastLayer& layer, const Grid& grid, double step_factor);

// The bricks that the ray caster of a scene may need; after cells.show().
BrickMask bricks_for_rays(const RayCastLayer& layer, const Volume& volume, const CellMap& cells,
                          double step_factor);

// The bricks that its slices run through, slab and filter included, less those of one value.
std::vector<glm::uvec3> bricks_for_slices(const Scene& scene, const Volume& volume);

// How parts of the volume are drawn; `first` says that nothing was drawn before.
gpu::AtlasFrame make_atlas_frame(BrickAtlas& atlas, const Volume& volume, const Part& part,
                                 bool first);

} // namespace palpate
