#version 460
#extension GL_EXT_scalar_block_layout : require

// Samples and texels of a volume and of a table at given places, in two invocations of three.
layout(local_size_x = 64) in;

layout(binding = 0) uniform sampler3D volume;
layout(binding = 1) uniform sampler1DArray table;
layout(scalar, binding = 2) readonly buffer Places { vec4 places[]; };
layout(scalar, binding = 3) writeonly buffer Results { vec4 results[]; };

void main() {
    const uint i = gl_GlobalInvocationID.x;
    const vec4 at = places[i];
    if (i % 3u == 0u)
        return;
    results[3u * i] = textureLod(volume, at.xyz, 0.0);
    results[3u * i + 1u] = textureLod(table, at.xw, 0.0);
    results[3u * i + 2u] = texelFetch(volume, ivec3(floor(at.xyz * 8.0)), 0);
}
