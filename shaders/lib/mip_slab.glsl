// The places of the slabs of a MIP (see kMipWords). Needs `frame`.

// Number of a tile's words among all tiles of a pass of so many rays.
uint slab_words_of(uvec2 tile, uint eye, uvec2 rays) {
    const uvec2 count = (rays + kTileSide - 1u) / kTileSide;
    return kMipWords * tile_number(tile, eye, count);
}
