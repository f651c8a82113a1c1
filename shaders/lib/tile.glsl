// The number of an eye's tile among all, of `count` tiles an eye.
uint tile_number(uvec2 tile, uint eye, uvec2 count) {
    return (eye * count.y + tile.y) * count.x + tile.x;
}

// Sixteen lanes take every second pixel both ways: packets of 2x4 rays, which cover 4x8 pixels. From
// the front of a head 4x2 rays take 4 % longer on lavapipe; from elsewhere it is all one.
uvec2 second_pixel_in_tile(uint lane) { return 2u * uvec2((lane & 1u) + (lane >> 3 & 1u) * 2u, lane >> 1 & 3u); }

// The lane's pixel within an 8x8 tile: packets of 4x2 pixels suit 8-wide devices best.
uvec2 pixel_in_tile(uint lane) {
    const uint packet = lane >> 3;
    return uvec2((packet & 1u) * 4u + (lane & 3u), (packet >> 1) * 2u + ((lane >> 2) & 1u));
}
