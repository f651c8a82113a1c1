// The passes of extraction share the frame and the order of samples.

layout(scalar, binding = kExtractFrame) uniform Frame { ExtractFrame frame; };

const int kOrderLowest = -2147483647 - 1;
const int kOrderHighest = 2147483647;

// Which entry of a list this workgroup is for.
uint listed_group() { return gl_WorkGroupID.x + kExtractMostGroups * gl_WorkGroupID.y; }

ivec3 block_at(uint number) {
    const uvec3 n = frame.blocks;
    return ivec3(number % n.x, number / n.x % n.y, number / (n.x * n.y)) - int(frame.lead);
}

// Floats by their bits, in the order of their values, which no device rounds or flushes to zero: so
// that every device finds the same samples inside. -0 lies just below 0. No data lies nowhere: see
// is_inside().
int sample_order(uint bits) {
    const int i = int(bits);
    return i ^ ((i >> 31) & 0x7fffffff);
}

bool is_missing(uint bits) { return (bits & 0x7fffffffu) > 0x7f800000u; }

bool is_inside(uint bits) { return !is_missing(bits) && sample_order(bits) >= frame.iso_order; }
