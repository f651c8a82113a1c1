#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// Puts meshes into the picture: opaque ones among what lies behind the rays, all of them into the
// picture as it is without ray casting, and (HAS_LAYERS) the see-through ones where the ray caster
// finds them. One invocation a pixel.

#include "shaders/shared/surface.h"
#include "shaders/lib/surface.glsl"
#include "shaders/lib/surface_layer.glsl"

layout(local_size_x = 64) in;

layout(scalar, binding = kSurfaceStyles) readonly buffer Styles { SurfaceStyleEntry styles[]; };
layout(scalar, binding = kSurfaceNearest) readonly buffer Nearest { uvec2 nearest[]; };
#if HAS_THROUGH
layout(scalar, binding = kSurfaceThrough) readonly buffer Through { uvec2 through[]; };
#endif
layout(binding = kSurfaceBehind, rgba32f) uniform image2DArray behind_image;
layout(binding = kSurfaceBehindValues, rg32f) uniform image2DArray behind_values_image;
layout(binding = kSurfaceColor, rgba32f) uniform writeonly image2DArray color_image;
#if HAS_VALUES
layout(binding = kSurfaceValues, rg32f) uniform writeonly image2DArray value_image;
#endif
#if HAS_LAYERS
layout(binding = kSurfaceLayers, rgba32ui) uniform writeonly uimage2DArray layers_image;
#endif

struct Seen {
    vec4 color; // opacity in a
    vec2 values; // value, distance in mm
};

Seen seen_of(uvec2 key, vec2 at) {
    const uint low = low_of(key);
    const bool any = low < kSurfaceNone && key != kNothing;
    const SurfaceStyleEntry style = styles[any ? low >> 16 & kSurfaceStyleMask : 0u];
    const float facing = float(low & 0xffffu) / 65535.0;
    const float spec = style.shading.z * pow(facing, style.shading.w);
    const vec3 color =
        clamp(style.color.rgb * (style.shading.x + style.shading.y * facing) + spec, 0.0, 1.0);
    return Seen(vec4(color, any ? style.color.a : 0.0),
                vec2(style.value, depth_of(key) * ray_mm(at)));
}

void main() {
    const uvec2 pixel = pixel_of(uvec2(gl_GlobalInvocationID.x, gl_WorkGroupID.y));
    if (!is_drawn(pixel))
        return;
    const ivec3 at_pixel = ivec3(pixel, frame.eye);
    const uint place = place_of(pixel);
    const vec2 at = image_point(vec2(pixel));
    const uvec2 opaque = nearest[place];
    const bool clears = frame.clears != 0u;
    vec4 behind = imageLoad(behind_image, at_pixel);
    behind = clears ? frame.nothing : behind;
    vec2 values = imageLoad(behind_values_image, at_pixel).rg;
    values = clears ? vec2(uintBitsToFloat(0x7fc00000u)) : values;
    const Seen last = seen_of(opaque, at);
    if (last.color.a > 0.0 || clears) {
        behind = last.color.a > 0.0 ? vec4(last.color.rgb, 1.0) : behind;
        values = last.color.a > 0.0 ? last.values : values;
        imageStore(behind_image, at_pixel, behind);
        imageStore(behind_values_image, at_pixel, vec4(values, 0.0, 0.0));
    }
    vec4 front = vec4(0.0);
#if HAS_THROUGH
    vec2 first = vec2(0.0, -1.0);
    uint count = 0u;
    bool going = true;
    while (going) {
        const bool within = count < frame.depth;
        const uvec2 key = through[place * frame.depth + (within ? count : 0u)];
        const Seen seen = seen_of(key, at);
        going = within && seen.color.a > 0.0 && depth_of(key) < depth_of(opaque);
        // With the digits that the ray caster gets.
        const uvec4 texel = packed_layer(
            going ? SurfaceLayer(seen.color, seen.values.x, seen.values.y) : no_layer());
        const SurfaceLayer layer = unpacked_layer(texel);
        first = going && first.y < 0.0 ? seen.values : first;
        front += (1.0 - front.a) * (layer.color.a * vec4(layer.color.rgb, 1.0));
#if HAS_LAYERS
        if (within)
            imageStore(layers_image, ivec3(pixel, frame.eye * frame.depth + count), texel);
#endif
        count += 1u;
    }
    values = first.y < 0.0 ? values : first;
#endif
    imageStore(color_image, at_pixel, front + (1.0 - front.a) * behind);
#if HAS_VALUES
    imageStore(value_image, at_pixel, vec4(values, 0.0, 0.0));
#endif
}
