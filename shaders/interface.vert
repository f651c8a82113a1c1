// Triangles of the interface: positions in pixels of the window, colours of 8 bits a channel.
#version 460
layout(push_constant) uniform Push { vec2 pixels; } push;
layout(location = 0) in vec2 position;
layout(location = 1) in vec2 texel;
layout(location = 2) in vec4 color;
layout(location = 0) out vec2 out_texel;
layout(location = 1) out vec4 out_color;

void main() {
    out_texel = texel;
    out_color = color;
    gl_Position = vec4(2.0 * position / push.pixels - 1.0, 0.0, 1.0);
}
