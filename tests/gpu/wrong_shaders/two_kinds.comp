#version 460
// expected: binding 3 is both
layout(local_size_x = 1) in;
layout(binding = 3) uniform Block { uint value; };
layout(binding = 3) buffer Other { uint out_value; };
void main() {
    out_value = value;
}
