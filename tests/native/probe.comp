#version 460
#extension GL_EXT_scalar_block_layout : require
// What tests/native/probe_kernel.cpp does by hand; drivers that compile shaders run this one.
layout(local_size_x = 1) in;
layout(constant_id = 7) const uint kStep = 1u;
layout(binding = 0, scalar) buffer Counts { uint counts[]; };
layout(binding = 1, scalar) uniform Block { uint added; };

void main() {
    uvec3 id = gl_WorkGroupID;
    atomicAdd(counts[id.x + 8u * (id.y + 8u * id.z)], kStep * added);
}
