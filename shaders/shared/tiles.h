// Bindings of the pass that lists the tiles worth marching.
#ifndef PALPATE_SHARED_TILES_H
#define PALPATE_SHARED_TILES_H
#include "shaders/shared/ray_cast.h"
GPU_BEGIN
const uint kTileFrame = 0u;
const uint kTileCells = 1u;   // as kRayCells
// Tiles listed, and groups of four of them, as the groups of two dispatches: (0, 1, 1, 0, 1, 1)
// before the pass.
const uint kTileGroups = 2u;
const uint kTileGroupWords = 6u;
const uint kTileQuarters = 3u;  // where the second dispatch begins
const uint kTileEntries = 3u; // TileEntry[], room for every tile
const uint kTileSpans = 5u;   // vec2[], row by row and eye by eye: near and far of every tile in range, listed
                              // or not; near is negative where it is not
const uint kTileRange = 6u;
struct TileRange { // that are looked at: from `first` on and before `end`, across and down
    uvec2 first;
    uvec2 end;
};
const uint kTileSlabs = 4u;   // kMipWords words for each tile of the pass

const uint kListBox = 0u;     // every tile that sees the volume's box, whole
const uint kListVisible = 1u; // those in which something can be seen, and from where to where
const uint kListAll = 2u;
GPU_END
#endif
