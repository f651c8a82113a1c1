// A block of 8^3 samples in shared memory: which samples are inside, which edges are crossed and
// which number the vertex on each has. The order is that of engine/surface/block_cells.h: vertices
// sample by sample, x fastest, of each sample its edges along x, y, z; first those of the block's
// own samples, then those that its cells borrow from the next blocks.
//
// Rows run along x; row (y, z), 0 .. 8 on both axes, has the number y + 9 z. Bit 3 x + axis of
// edges_of_row: the edge along `axis` from sample x is crossed.

#define GROUP_LANES kExtractGroup
#include "shaders/lib/group_sums.glsl"

layout(binding = kExtractSamples) uniform usampler3D samples;

shared uint inside_of_row[81];  // bit x, 0 .. 8
shared uint edges_of_row[81];
shared uint before_row[81];     // own vertices before the row, | borrowed ones << 16

const uint kOwnBits = 0x00ffffffu; // edges from samples 0 .. 7

// The bits of a sample as a float.
uint sample_at(ivec3 at) {
    const ivec3 nearest = clamp(at, ivec3(0), frame.size - 1);
    const uint texel = texelFetch(samples, nearest, 0).r;
    const uint value = floatBitsToUint(float(int(texel) - frame.bias));
    const uint bits = frame.is_float != 0u ? texel : value;
    const bool beyond = frame.closed != 0u && at != nearest;
    return beyond ? 0x7fc00000u : bits;
}

// The volume's last sample from the block's first one on, as far as matters: 0 .. 8.
ivec3 last_in(ivec3 block) { return min(frame.last - 8 * block, ivec3(8)); }

// n / 9 for n < 128: division of integers is slow where it is done lane by lane.
uint ninth(uint n) { return n * 57u >> 9; }

// Bit 3 i for bit i of the lowest ten.
uint three_apart(uint bits) {
    bits = (bits | bits << 16) & 0x030000ffu;
    bits = (bits | bits << 8) & 0x0300f00fu;
    bits = (bits | bits << 4) & 0x030c30c3u;
    return (bits | bits << 2) & 0x09249249u;
}

// From inside_of_row. Edges that lead out of sample 8 of an axis belong to no cell of the block.
uint crossed_edges(int y, int z, ivec3 last) {
    const uint row = inside_of_row[y + 9 * z];
    const uint next_y = inside_of_row[min(y + 1, 8) + 9 * z];
    const uint next_z = inside_of_row[y + 9 * min(z + 1, 8)];
    const uint along_x = (row ^ row >> 1) & ((1u << last.x) - 1u);
    const uint exist = (2u << last.x) - 1u;
    const uint along_y = y < last.y ? (row ^ next_y) & exist : 0u;
    const uint along_z = z < last.z ? (row ^ next_z) & exist : 0u;
    const uint edges = three_apart(along_x) | three_apart(along_y) << 1 | three_apart(along_z) << 2;
    return y <= last.y && z <= last.z ? edges : 0u;
}

uint own_bits(int y, int z) { return y < 8 && z < 8 ? kOwnBits : 0u; }

// Fills edges_of_row and before_row; returns how many are own, | borrowed << 16. By all lanes, after
// inside_of_row is there.
uint number_edges(uint lane, ivec3 last) {
    uint counts[2];
    for (uint i = 0u; i < 2u; ++i) { // each lane has two rows that follow each other
        const uint row = 2u * lane + i;
        const int z = int(ninth(row)), y = int(row) - 9 * z;
        const uint edges = row < 81u ? crossed_edges(y, min(z, 8), last) : 0u;
        if (row < 81u)
            edges_of_row[row] = edges;
        const uint own = own_bits(y, z);
        counts[i] = uint(bitCount(edges & own)) | uint(bitCount(edges & ~own)) << 16;
    }
    uint total;
    const uint before = sum_before(lane, counts[0] + counts[1], total);
    if (2u * lane < 81u)
        before_row[2u * lane] = before;
    if (2u * lane + 1u < 81u)
        before_row[2u * lane + 1u] = before + counts[0];
    return total;
}

// The number of the vertex on a crossed edge; `own` vertices of the block's own are before those it
// borrows.
uint vertex_on(int y, int z, uint bit, uint own) {
    const uint row = uint(y + 9 * z);
    const uint mask = own_bits(y, z);
    const uint below = edges_of_row[row] & ((1u << bit) - 1u);
    const uint start = before_row[row];
    const bool is_own = (mask >> bit & 1u) != 0u;
    return is_own ? (start & 0xffffu) + uint(bitCount(below))
                  : own + (start >> 16) + uint(bitCount(below & ~mask));
}

// The cells of row (y, z), 0 .. 7, that the surface crosses: bit x. `corners` are the four rows of
// samples about them.
uint crossed_cells(int y, int z, ivec3 last, out uvec4 corners) {
    corners = uvec4(inside_of_row[y + 9 * z], inside_of_row[y + 1 + 9 * z],
                    inside_of_row[y + 9 * z + 9], inside_of_row[y + 1 + 9 * z + 9]);
    const uint any = corners.x | corners.y | corners.z | corners.w;
    const uint all = corners.x & corners.y & corners.z & corners.w;
    const uint cells = (any | any >> 1) & ~(all & all >> 1) & ((1u << last.x) - 1u);
    return y < last.y && z < last.z ? cells : 0u;
}

// Bit c: corner c of the cell is inside.
uint case_of(uvec4 corners, uint x) {
    const uvec4 pair = corners >> x & 3u;
    return pair.x | pair.y << 2 | pair.z << 4 | pair.w << 6;
}
