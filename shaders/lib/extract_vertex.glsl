// The vertex on a crossed edge: the arithmetic of engine/surface/block_cells.cpp, step by step, so
// that its bits come out. Products, sums and differences are rounded to the nearest float by any
// device as long as they are normal numbers; `precise` keeps them from being fused.

// kLeastFraction of engine/surface/marching_cubes.h, and how far the vertex is kept from either end.
const float kLeastFraction = 1.0 / 4096.0;
const float kMostFraction = 1.0 - kLeastFraction;

// How far from a to b the samples reach iso.
float fraction(float a, float b) {
    precise const float to_iso = frame.iso - a;
    precise const float to_b = b - a;
    const float t = exact_quotient(abs(to_iso), abs(to_b)); // iso lies between: of one sign
    return t > kLeastFraction ? min(t, kMostFraction) : kLeastFraction;
}

vec3 along_axis(uint axis, bool falling) {
    const float one = falling ? 1.0 : -1.0;
    return vec3(axis == 0u ? one : 0.0, axis == 1u ? one : 0.0, axis == 2u ? one : 0.0);
}

// Twice the slope across a sample, 1331 of them in `value` with 11 and 121 to the next row and layer.
// A missing neighbour counts as equal to the sample.
float difference(uint at, uint stride) {
    const uint here = value[at], below = value[at - stride], above = value[at + stride];
    const float b = uintBitsToFloat(is_missing(below) ? here : below);
    const float a = uintBitsToFloat(is_missing(above) ? here : above);
    precise const float d = a - b;
    return d;
}
vec3 differences(uint at) {
    return vec3(difference(at, 1u), difference(at, 11u), difference(at, 121u));
}

bool is_usable(float squared) { return squared > 1e-30 && squared < 1e30; }

float largest(vec3 v) { return max(abs(v.x), max(abs(v.y), abs(v.z))); }

// v with its largest component in [1, 2), by a power of two; 0 and what is not finite stay.
vec3 to_size(vec3 v) {
    const int exponent = int(floatBitsToUint(largest(v)) >> 23);
    const int by = clamp(254 - exponent, 1, 253);
    return exponent == 0 || exponent == 255 ? v : v * uintBitsToFloat(uint(by) << 23);
}

// A normal from a gradient whose square is beyond floats. The CPU takes doubles; here numbers are
// brought to the size of 1 first, by a power of two, so that what two slopes leave of each other has
// the CPU's bits. Then 2^-24 is rounded off of each of some six terms, and normals lie within 2^-21
// of those; gradients below 2^-126 count as none.
vec3 careful_normal(vec3 low, vec3 high, float t, uint axis, bool falling) {
    const float size = max(largest(low), largest(high));
    const int exponent = int(floatBitsToUint(size) >> 23);
    const float by = uintBitsToFloat(uint(clamp(254 - exponent, 1, 253)) << 23);
    const vec3 a = low * by, b = high * by;
    precise const vec3 between = a + t * (b - a);
    const vec3 gradient = to_size(to_size(between) * to_size(frame.normal_scale));
    const float squared = dot(gradient, gradient);
    const vec3 normal = -gradient / sqrt(squared);
    return exponent > 0 && exponent < 255 && is_usable(squared) ? normal
                                                                : along_axis(axis, falling);
}

struct Vertex {
    vec3 position; // mm
    vec3 normal;
};

// `sample` of the volume at the edge's lower end, which lies at `at` in `value`.
Vertex vertex_at(ivec3 lower_end, uint at, uint axis) {
    const uint above = at + (axis == 0u ? 1u : axis == 1u ? 11u : 121u);
    const uint bits_low = value[at], bits_high = value[above];
    const bool low_missing = is_missing(bits_low), high_missing = is_missing(bits_high);
    const bool wall = low_missing || high_missing;
    const float low = uintBitsToFloat(bits_low), high = uintBitsToFloat(bits_high);
    const float on_wall = high_missing ? kLeastFraction : kMostFraction;
    const float t = wall ? on_wall : fraction(low, high);
    precise const vec3 at_samples = vec3(lower_end) + vec3(axis == 0u ? t : 0.0,
                                                           axis == 1u ? t : 0.0,
                                                           axis == 2u ? t : 0.0);
    precise const vec3 position = at_samples * frame.spacing_mm;
    Vertex vertex = Vertex(position, vec3(0.0));
    if (kNormals != 0u) {
        const vec3 l = differences(at), h = differences(above);
        precise const vec3 gradient = (l + t * (h - l)) * frame.normal_scale;
        precise const float squared =
            gradient.x * gradient.x + gradient.y * gradient.y + gradient.z * gradient.z;
        const bool usable = is_usable(squared);
        const float inverse = -exact_quotient(1.0, exact_root(usable ? squared : 1.0));
        precise const vec3 normal = gradient * inverse;
        const vec3 rare = careful_normal(l, h, t, axis, low > high);
        vertex.normal = wall ? along_axis(axis, high_missing) : usable ? normal : rare;
    }
    return vertex;
}
