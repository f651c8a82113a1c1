// Passes over meshes share this: pixels and their rays in camera space, keys, and what clip planes keep.
// A key is (low half, bits of the depth), in memory a number of 64 bits with the depth above.

layout(scalar, binding = kSurfaceFrame) uniform FrameBlock { SurfaceFrame frame; };

const float kFarAway = 1e30;
const uvec2 kNothing = uvec2(kSurfaceNone, 0x7149f2cau); // key_of(kFarAway, kSurfaceNone)

uvec2 key_of(float depth, uint low) { return uvec2(low, floatBitsToUint(depth)); }
float depth_of(uvec2 key) { return uintBitsToFloat(key.y); }
uint low_of(uvec2 key) { return key.x; }
bool is_before(uvec2 a, uvec2 b) { return a.y < b.y || (a.y == b.y && a.x < b.x); }

// The point at which a pixel's ray crosses the plane at depth 1 (perspective) or any plane (orthographic).
vec2 image_point(vec2 pixel) {
    return mix(frame.bounds.xw, frame.bounds.yz, (pixel + 0.5) / vec2(frame.size_px));
}

// Millimetres along the ray for one millimetre of depth.
float ray_mm(vec2 at) { return frame.orthographic != 0u ? 1.0 : sqrt(1.0 + dot(at, at)); }

vec3 ray_direction(vec2 at) {
    return frame.orthographic != 0u ? vec3(0.0, 0.0, 1.0) : vec3(at, 1.0) / ray_mm(at);
}

// The pixel of an invocation, of workgroups of 64 in rows, and whether it is among those that are drawn.
uvec2 pixel_of(uvec2 invocation) { return frame.low_px + invocation; }
bool is_drawn(uvec2 pixel) { return pixel.x < frame.low_px.x + frame.part_px.x; }

// A pixel's place among those that are drawn.
uint place_of(uvec2 pixel) {
    const uvec2 at = pixel - frame.low_px;
    return at.x + frame.part_px.x * at.y;
}

// The depths between which every clip plane keeps what is seen; x > y where none does.
vec2 kept_stretch(vec2 at) {
    vec2 kept = vec2(0.0, kFarAway);
    for (uint i = 0u; i < frame.clip_count; ++i) {
        const SurfaceClip clip = frame.clips[i];
        const float across = dot(clip.normal.xy, at);
        const bool parallel = frame.orthographic != 0u;
        const float rate = clip.normal.z + (parallel ? 0.0 : across);
        const float start = clip.offset + (parallel ? across : 0.0);
        const float crossing = -start / (rate == 0.0 ? 1.0 : rate);
        kept.x = rate > 0.0 ? max(kept.x, crossing) : kept.x;
        kept.y = rate < 0.0 ? min(kept.y, crossing) : kept.y;
        kept.y = rate == 0.0 && start < 0.0 ? -1.0 : kept.y;
    }
    return kept;
}

// The look of a style at this angle, as the low half of a key.
uint shaded(uint style, float facing) {
    return kSurfaceShaded | style << 16 | uint(clamp(facing, 0.0, 1.0) * 65535.0 + 0.5);
}
