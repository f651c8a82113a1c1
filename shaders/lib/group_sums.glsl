// Sums over a group of GROUP_LANES, at most 64, in the order of lanes: of those before, and of all.
// To be called by all lanes.

shared uint partial_sums[GROUP_LANES + 8u];

uint sum_before(uint lane, uint value, out uint total) {
    const uint eight = lane & ~7u; // the first of eight lanes
    barrier();
    partial_sums[lane] = value;
    barrier();
    uint before = 0u, all = 0u;
    for (uint i = 0u; i < 8u; ++i) {
        const uint one = partial_sums[eight + i];
        all += one;
        before += eight + i < lane ? one : 0u;
    }
    if (lane == eight)
        partial_sums[GROUP_LANES + (lane >> 3)] = all;
    barrier();
    total = 0u;
    for (uint i = 0u; i < 8u; ++i) {
        const uint of_eight = partial_sums[GROUP_LANES + i];
        before += 8u * i < eight ? of_eight : 0u;
        total += of_eight;
    }
    return before;
}
