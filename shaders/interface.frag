// Draws the interface: a texture times a colour.
#version 460
layout(binding = 0) uniform sampler2DArray picture;
layout(location = 0) in vec2 texel;
layout(location = 1) in vec4 color;
layout(location = 0) out vec4 out_color;

void main() {
    out_color = color * texture(picture, vec3(texel, 0.0));
}
