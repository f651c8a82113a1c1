#pragma once

#include "engine/render/gpu_volume.h"
#include "engine/scene/scene.h"
#include "shaders/shared/atlas.h"

// The bricks that a scene needs of a volume in an atlas, and the parts they are marched in.
namespace palpate {

// How far from a visible sample the march of a layer may read others, in samples: the neighbours
// that gradients are taken from, or the other end of a segment. Steps are up to step_factor times
// as long as the layer's.
double reach_samples(const RayCastLayer& layer, const Grid& grid, double step_factor);

// How parts of the volume are drawn; `first` says that nothing was drawn before.
gpu::AtlasFrame make_atlas_frame(BrickAtlas& atlas, const Volume& volume, const Part& part,
                                 bool first);

} // namespace palpate
