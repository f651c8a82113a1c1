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
const uint kSliceOver = 10u;  // SliceOver, where there is a fused volume or an overlay
const uint kSliceFused = 11u;
const uint kSliceFusedTable = 12u;
const uint kSliceOverlay = 13u; // labels
const uint kSliceOverlayStyles = 14u;

const uint kSmoothLabels = 1u; // of the shader's constant kSmooth
const uint kSmoothOverlay = 2u;

// The layers over slices, from index positions of the volume.
struct SliceOver {
    mat3 fused_from_index; // index in the fused volume: fused_from_index * index + fused_origin
    vec3 fused_origin;
    vec3 fused_last;       // its size - 1
    vec3 fused_texture;    // 1 / size
    float fused_table_scale, fused_table_bias; // of its texels, as Frame's
    float fused_opacity;
    float fused_unit_mm;   // of the table's optical depths
    mat3 overlay_from_index; // texture coordinates, as Frame's of labels
    vec3 overlay_origin;
    float overlay_opacity;
    float overlay_outline_px;
    uint overlay_styles;   // entries of the style buffer
};
GPU_END
#endif
