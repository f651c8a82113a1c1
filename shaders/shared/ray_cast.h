// Bindings and constants of the ray caster.
#ifndef PALPATE_SHARED_RAY_CAST_H
#define PALPATE_SHARED_RAY_CAST_H
#include "shaders/shared/atlas.h"
#include "shaders/shared/frame.h"
GPU_BEGIN
const uint kRayFrame = 0u;
const uint kRayVolume = 1u;
const uint kRayTable = 2u;
const uint kRayLabels = 3u;
const uint kRayStyles = 4u;
const uint kRayBehind = 5u;       // colour of the slices
const uint kRayBehindValues = 6u; // (value, distance in mm) of the slices; NaN where there is none
const uint kRayColor = 7u;
const uint kRayValues = 8u;       // (value, distance in mm); NaN where there is none
// Integrator exact:
const uint kRayCorners = 20u;     // the volume, unfiltered
const uint kRaySmoothTable = 21u; // the table, linear between entries
const uint kRayCells = 9u;        // distances to occupied macro-cells; MIP: highest of mip_sign * texel in each
const uint kRayTiles = 10u;       // TileEntry[]
const uint kRayTileGroups = 11u;  // how many of them, as the groups of dispatches (kTileGroups)
const uint kRayPages = 12u;       // atlas: where each brick lies
const uint kRayAtlas = 13u;       // atlas: AtlasFrame
const uint kRayGradients = 15u;   // MIP, alpha: of the volume, one texel a sample; only with kStored
const uint kRayCarry = 14u;       // atlas: what rays carry from part to part; kCarryLayers an eye
const uint kRaySlabs = 17u;       // MIP: kMipWords words for each tile of the pass
const uint kRaySpans = 18u;       // of rays between tiles: see kTileSpans
const uint kRayFirstHits = 19u;   // iso: float[], mm; 0 for nothing (lib/first_hits.glsl)
const uint kRaySurfaces = 16u;    // see-through triangles in a ray's way (lib/surface_layer.glsl)

// Which rays a pass has:
const uint kRaysAll = 0u;         // of every pixel in the listed tiles
const uint kRaysEverySecond = 1u; // of every second one both ways
const uint kRaysListed = 2u;      // of pixels listed one by one
const uint kRaysSparse = 3u;      // as kRaysAll, of pixels far apart

const uint kModeMip = 0u;
const uint kModeAlpha = 1u;
const uint kModeIso = 2u;

const float kHighlightFade = 8.0f; // of a light that is not at the eye: one over the cosine
// Ambient occlusion (lib/occlusion.glsl).
const uint kOcclusionAxes = 24u;
const uint kOcclusionSteps = 8u;   // places on each
const float kOcclusionFall = 16.0f; // the radius by the distance over which a place becomes hidden

const uint kTableEntries = 4096u;
const uint kTableRowStep = 0u;      // rgb, opacity of one whole step
const uint kTableRowTau = 1u;       // rgb, tau per mm
const uint kTableRowIntegral = 2u;  // running integrals
const uint kTableRowVisible = 3u;   // r: how many entries up to this one have opacity; g: below it; what lies between two entries counts too
const uint kTableRows = 4u;
// Between places of the table nearer than this, the table counts as linear.
const float kNarrowEntries = 2.0f;
const float kLeastSpan = 1.0f / 4096.0f;           // sub-steps are not cut below this share
const float kLeastTransmittance = 1.0f / 1048576.0f; // a piece ends where less comes through

const uint kTileSide = 8u;          // pixels; one workgroup of 64 marches one tile

// One tile of a picture that rays are marched in.
struct TileEntry {
    uint tile;         // x + 2^15 y + 2^30 eye, in tiles
    float near, far;   // mm: outside of these its rays meet nothing that can be seen
    uint samples;      // taken in it; written by the counting variant only
};


// MIP: the lattice of a tile's rays is parted into slabs (shaders/mip_slabs.comp). A tile has
// kMipWords words: the first slab's first segment and the segments a slab, as floats; and of each
// slab, highest first, a float that no texel sampled in it exceeds, whose lowest bits are its number.
const uint kMipSlabBits = 5u;
const uint kMipSlabs = 1u << kMipSlabBits;
const uint kMipWords = kMipSlabs + 2u;
const float kLeastSlabSteps = 4.0f;
const uint kCarryLayers = 2u; // an eye: colour, and values (lib/carry.glsl)
const uint kListedAcross = 32768u; // workgroups of listed rays side by side; more lie in further rows
const uint kTileXBits = 15u;
const uint kTileEyeShift = 30u;
GPU_END
#endif
