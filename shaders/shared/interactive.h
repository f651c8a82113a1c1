// Bindings of the passes that make a picture from fewer rays than it has pixels.
#ifndef PALPATE_SHARED_INTERACTIVE_H
#define PALPATE_SHARED_INTERACTIVE_H
#include "shaders/shared/ray_cast.h"
GPU_BEGIN
// interpolate.comp: fills a picture from every second pixel both ways, and lists the pixels beside
// which that would show.
struct InterpolateBlock {
    uvec2 size_px;
    float contrast; // see CoarseSettings
};
const uint kInterpolateBlock = 0u;
const uint kInterpolateColor = 1u;  // every second pixel is there
const uint kInterpolateSpans = 2u;  // see kTileSpans
// As kRayTileGroups, and how many of every second pixel were marched: (0, 1, 1, 0, 0) before the pass.
const uint kInterpolateGroups = 3u;
const uint kRayGroupWords = 5u;
const uint kInterpolateRays = 4u;   // the pixels listed: x + 2^15 y + 2^30 eye

// enlarge.comp: fills a picture from rays farther apart.
struct EnlargeBlock {
    uvec2 size_px;
    uvec2 rays;      // texels of kEnlargeFew that are there
    uvec2 first_px;  // the pixel of the first
    uint px_per_ray;
};
const uint kEnlargeBlock = 0u;
const uint kEnlargeFew = 1u;   // one texel a ray
const uint kEnlargeColor = 2u;
const uint kEnlargeSpans = 3u; // see kTileSpans
const uint kEnlargeGroup = 8u; // side of a workgroup: rays across, and one more; pixels down

// judge.comp: the squared error of some pixels against rays of full quality.
struct JudgeBlock {
    uvec2 rays;     // of the sparse pass
    uvec2 first_px;
    uint px_per_ray;
};
const uint kJudgeBlock = 0u;
const uint kJudgeColor = 1u;
const uint kJudgeTruth = 2u;   // one texel a ray of the sparse pass
const uint kJudgeSquares = 3u; // float[]: mean of the squares over r, g, b; one a ray
GPU_END
#endif
