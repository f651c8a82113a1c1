// The lane's pixel within an 8x8 tile: packets of 4x2 pixels suit 8-wide devices best.
uvec2 pixel_in_tile(uint lane) {
    const uint packet = lane >> 3;
    return uvec2((packet & 1u) * 4u + (lane & 3u), (packet >> 1) * 2u + ((lane >> 2) & 1u));
}
