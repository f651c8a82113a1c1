#version 460
#extension GL_EXT_scalar_block_layout : require
// Declares what tests/native/probe_kernel.cpp tells of the images that it is given.
layout(local_size_x = 1) in;
layout(binding = 0, scalar) buffer Told { uint told[]; };
layout(binding = 2) uniform sampler3D volume;
layout(binding = 3, rgba32f) uniform image2DArray picture;

void main() {
    told[0] = uint(textureLod(volume, vec3(0.5), 0.0).x + imageLoad(picture, ivec3(0)).x);
}
