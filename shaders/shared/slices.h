// Bindings of the slice pass.
#ifndef PALPATE_SHARED_SLICES_H
#define PALPATE_SHARED_SLICES_H
#include "shaders/shared/frame.h"
#include "shaders/shared/ray_cast.h"
GPU_BEGIN
const uint kSliceFrame = 0u;
const uint kSliceVolume = 1u;
const uint kSliceTable = 2u;
const uint kSliceLabels = 3u;
const uint kSliceStyles = 4u;
const uint kSlicePlanes = 5u;
const uint kSliceColor = 6u;
const uint kSliceValues = 7u; // (value, distance in mm); NaN where there is none
const uint kSlicePages = 8u;  // atlas: where each brick lies
const uint kSliceAtlas = 9u;  // atlas: AtlasFrame
GPU_END
#endif
