// A cell's entry: where its vertices begin among the block's (12 bits), its crossed edges (12), the
// splits of its faces (two bits each) and the vertex of each crossed edge (two bits each,
// see engine/surface/net_cell.h). In memory: first | crossed << 12 | low splits << 24, and
// edges' vertices | high splits << 24.

struct Cell {
    uint first;   // vertex
    uint crossed; // bit e
    uint splits;  // two bits a face: 0, or one more than the first of the corners that are cut off
    uint numbers; // two bits an edge
};

uvec2 packed(Cell c) {
    return uvec2(c.first | c.crossed << 12 | c.splits << 24, c.numbers | c.splits >> 8 << 24);
}
Cell unpacked(uvec2 bits) {
    return Cell(bits.x & 0xfffu, bits.x >> 12 & 0xfffu, bits.x >> 24 | bits.y >> 24 << 8,
                bits.y & 0xffffffu);
}

#ifndef NET_CELLS_WRITTEN
layout(scalar, binding = kNetPlaces) readonly buffer Places { NetPlace places[]; };
layout(scalar, binding = kNetCells) readonly buffer Cells { uvec2 cells[]; };

// A cell anywhere; `first` then counts from the first vertex of all. Without crossed edges where there
// is none.
Cell cell_at(ivec3 at) {
    const bool exists = all(greaterThanEqual(at, ivec3(0))) && all(lessThanEqual(at, frame.size));
    const ivec3 near = clamp(at, ivec3(0), frame.size);
    const uvec3 block = uvec3(near >> 3), in_block = uvec3(near & 7);
    const NetPlace place =
        places[block.x + frame.blocks.x * (block.y + frame.blocks.y * block.z)];
    const uint slot = max(place.slot, 1u) - 1u;
    Cell cell = unpacked(cells[512u * slot + in_block.x + 8u * in_block.y + 64u * in_block.z]);
    if (!exists || place.slot == 0u)
        cell = Cell(0u, 0u, 0u, 0u);
    cell.first += place.first_vertex;
    return cell;
}

uint vertex_on(Cell cell, uint e) { return cell.first + (cell.numbers >> 2u * e & 3u); }
#endif
