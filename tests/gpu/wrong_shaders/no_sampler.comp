#version 460
#extension GL_EXT_samplerless_texture_functions : require
// expected: 'image_alone' is no block, storage image or sampler with its image
layout(local_size_x = 1) in;
layout(binding = 0) uniform texture2D image_alone;
layout(binding = 1) buffer Block { ivec2 size; };
void main() {
    size = textureSize(image_alone, 0);
}
