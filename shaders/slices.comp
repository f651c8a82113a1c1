#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require

// Slices through the volume: per pixel the nearest plane that the ray meets inside the box, with its
// grey value through the transfer function and the label overlay. Leaves colour and distance, which
// the ray caster stops at; without a ray caster the colour is the picture. Built with and without
// HAS_LABELS, HAS_ATLAS, HAS_FUSION (another volume in colour, under the labels) and HAS_OVERLAY
// (more labels, over all).

#include "shaders/shared/slices.h"
#include "shaders/lib/rays.glsl"

layout(local_size_x = 64) in;

layout(scalar, binding = kSliceFrame) uniform FrameBlock { Frame frame; };
layout(binding = kSliceVolume) uniform sampler3D volume;
layout(binding = kSliceTable) uniform sampler1DArray table;
#if HAS_LABELS
layout(binding = kSliceLabels) uniform usampler3D labels;
layout(scalar, binding = kSliceStyles) readonly buffer Styles { vec4 styles[]; };
#endif
layout(scalar, binding = kSlicePlanes) uniform Planes { SliceIndex planes[kMaxSlices]; };
#if HAS_ATLAS
layout(binding = kSlicePages) uniform sampler3D pages;
layout(scalar, binding = kSliceAtlas) uniform AtlasBlock { AtlasFrame atlas; };
#endif
#if HAS_FUSION || HAS_OVERLAY
layout(scalar, binding = kSliceOver) uniform Over { SliceOver over; };
#endif
#if HAS_FUSION
layout(binding = kSliceFused) uniform sampler3D fused;
layout(binding = kSliceFusedTable) uniform sampler1DArray fused_table;
#endif
#if HAS_OVERLAY
layout(binding = kSliceOverlay) uniform usampler3D overlay;
layout(scalar, binding = kSliceOverlayStyles) readonly buffer OverlayStyles {
    vec4 overlay_styles[];
};
#endif
layout(binding = kSliceColor, rgba32f) uniform writeonly image2DArray color_image;
layout(binding = kSliceValues, rg32f) uniform writeonly image2DArray value_image;

layout(constant_id = 0) const uint kManual = 0u; // interpolate by hand, in fp32
layout(constant_id = 1) const uint kSmooth = 0u; // edges of: kSmoothLabels, kSmoothOverlay

#define kNaN uintBitsToFloat(0x7fc00000u)
#define kDiagonal 0.70710678

#include "shaders/lib/texels.glsl"
#if HAS_LABELS || HAS_OVERLAY
#include "shaders/lib/smooth_labels.glsl"
#endif

// Catmull-Rom weights of the four samples round a point `f` between the second and third.
vec4 cubic_weights(float f) {
    const float f2 = f * f, f3 = f2 * f;
    return 0.5 * vec4(-f3 + 2.0 * f2 - f, 3.0 * f3 - 5.0 * f2 + 2.0, -3.0 * f3 + 4.0 * f2 + f,
                      f3 - f2);
}

// `taps` is 4, or 0 where nobody wants it: llvmpipe walks through both sides of a condition, and past
// a loop without turns.
float cubic_at(vec3 index, int taps) {
    const vec3 low = floor(index);
    const vec3 f = index - low;
    const vec4 wx = cubic_weights(f.x), wy = cubic_weights(f.y), wz = cubic_weights(f.z);
    float sum = 0.0;
    for (int z = 0; z < taps; ++z)
        for (int y = 0; y < taps; ++y) {
            float row = 0.0;
            for (int x = 0; x < taps; ++x)
                row += wx[x] * stored_texel(ivec3(low) + ivec3(x, y, z) - 1);
            sum += wz[z] * wy[y] * row;
        }
    return sum;
}

// The texel of a slab about the plane; NaN where none of its samples has data.
float slab_texel(SliceIndex plane, vec3 index) {
    const bool largest = (plane.flags & kSliceMaximum) != 0u;
    const bool smallest = (plane.flags & kSliceMinimum) != 0u;
    const bool cubic = (plane.flags & kSliceCubic) != 0u;
    float sum = 0.0, most = -3.4e38, least = 3.4e38, count = 0.0;
    for (uint i = 0u; i < plane.samples; ++i) {
        const float offset = float(i) + 0.5 - 0.5 * float(plane.samples);
        const vec3 p = index + offset * plane.normal_step;
        // The plane's own sample is inside by construction, give or take rounding.
        const vec3 slack = vec3(plane.samples == 1u ? 1e-3 : 0.0);
        const bool within = all(greaterThanEqual(p, -slack)) &&
                            all(lessThanEqual(p, frame.last + slack));
        const float smooth_value = cubic_at(p, cubic ? 4 : 0);
        const float value = cubic ? smooth_value : texel_at_index(p);
        const bool counts = within && value == value;
        sum += counts ? value : 0.0;
        most = counts ? max(most, value) : most;
        least = counts ? min(least, value) : least;
        count += counts ? 1.0 : 0.0;
    }
    return count > 0.0 ? (largest ? most : smallest ? least : sum / count) : kNaN;
}

#if HAS_LABELS
uint label_at(vec3 index) {
    const uint label =
        textureLod(labels, frame.label_from_index * index + frame.label_origin, 0.0).r;
    return styles[min(label, frame.style_count - 1u)].a > 0.0 ? label : 0u;
}

vec3 label_index(vec3 index) {
    return (frame.label_from_index * index + frame.label_origin) * vec3(textureSize(labels, 0)) - 0.5;
}

LabelPlace label_place(vec3 index) {
    const vec3 at = label_index(index), low = floor(at);
    uint about[8];
    for (uint i = 0u; i < 8u; ++i) {
        const ivec3 sample_at = ivec3(low) + ivec3(i & 1u, i >> 1 & 1u, i >> 2);
        const ivec3 near = clamp(sample_at, ivec3(0), textureSize(labels, 0) - 1);
        const uint label = texelFetch(labels, near, 0).r;
        const bool shown = styles[min(label, frame.style_count - 1u)].a > 0.0;
        about[i] = shown && near == sample_at ? label : 0u;
    }
    return place_among(about, at - low);
}
#endif

#if HAS_OVERLAY
uint overlay_at(vec3 index) {
    const uint label =
        textureLod(overlay, over.overlay_from_index * index + over.overlay_origin, 0.0).r;
    return overlay_styles[min(label, over.overlay_styles - 1u)].a > 0.0 ? label : 0u;
}

vec3 overlay_index(vec3 index) {
    return (over.overlay_from_index * index + over.overlay_origin) * vec3(textureSize(overlay, 0)) -
           0.5;
}

LabelPlace overlay_place(vec3 index) {
    const vec3 at = overlay_index(index), low = floor(at);
    uint about[8];
    for (uint i = 0u; i < 8u; ++i) {
        const ivec3 sample_at = ivec3(low) + ivec3(i & 1u, i >> 1 & 1u, i >> 2);
        const ivec3 near = clamp(sample_at, ivec3(0), textureSize(overlay, 0) - 1);
        const uint label = texelFetch(overlay, near, 0).r;
        const bool shown = overlay_styles[min(label, over.overlay_styles - 1u)].a > 0.0;
        about[i] = shown && near == sample_at ? label : 0u;
    }
    return place_among(about, at - low);
}
#endif

#if HAS_FUSION
vec3 with_fusion(vec3 color, vec3 index) {
    const vec3 p = over.fused_from_index * index + over.fused_origin;
    const bool within = all(greaterThanEqual(p, vec3(0.0))) &&
                        all(lessThanEqual(p, over.fused_last));
    const float texel = textureLod(fused, (p + 0.5) * over.fused_texture, 0.0).r;
    const vec4 entry = textureLod(
        fused_table, vec2(texel * over.fused_table_scale + over.fused_table_bias,
                          float(kTableRowTau)), 0.0);
    const float weight = over.fused_opacity * (1.0 - exp(-entry.a * over.fused_unit_mm));
    return within && texel == texel ? mix(color, entry.rgb, weight) : color;
}
#endif

float plane_distance(SliceIndex plane, Ray ray) {
    const float rate = dot(plane.normal, ray.direction);
    const float at_start = dot(plane.normal, ray.origin) + plane.offset;
    return rate != 0.0 ? -at_start / rate : -1.0;
}

vec3 point_on(SliceIndex plane, FrameEye eye, vec2 pixel) {
    const Ray ray = ray_through(eye, pixel, frame.size_px);
    return ray.origin + plane_distance(plane, ray) * ray.direction;
}

void main() {
    const uvec2 tile = gl_WorkGroupID.xy;
    const uvec2 pixel = tile * kTileSide + pixel_in_tile(gl_LocalInvocationID.x);
    const FrameEye eye = frame.eyes[gl_WorkGroupID.z];
    const Ray ray = ray_through(eye, vec2(pixel), frame.size_px);

    float nearest = 1e30;
    uint which = 0u;
    for (uint i = 0u; i < frame.slice_count; ++i) {
        const float t = plane_distance(planes[i], ray);
        const vec3 p = ray.origin + t * ray.direction;
        const float slack = 1e-4; // index; keeps the plane of the outermost samples whole
        const bool within = all(greaterThanEqual(p, vec3(-slack))) &&
                            all(lessThanEqual(p, frame.last + slack));
        const bool closer = within && t >= 0.0 && t < nearest;
        nearest = closer ? t : nearest;
        which = closer ? i : which;
    }
    const bool hit = nearest < 1e30;
    const SliceIndex plane = planes[which];
    const vec3 index = clamp(ray.origin + nearest * ray.direction, vec3(0.0), frame.last);
    const float texel = slab_texel(plane, index);
    const float value = texel * frame.value_scale + frame.value_bias;
    const vec2 at = vec2(texel * frame.table_scale + frame.table_bias, float(kTableRowTau));
    vec3 color = textureLod(table, at, 0.0).rgb;
    color = value == value ? color : frame.background;

#if HAS_FUSION
    color = with_fusion(color, index);
#endif
    const vec2 sides[8] = vec2[8](vec2(1, 0), vec2(-1, 0), vec2(0, 1), vec2(0, -1),
                                  vec2(kDiagonal, kDiagonal), vec2(-kDiagonal, kDiagonal),
                                  vec2(kDiagonal, -kDiagonal), vec2(-kDiagonal, -kDiagonal));
#if HAS_LABELS || HAS_OVERLAY
    const vec3 across = point_on(plane, eye, vec2(pixel) + vec2(1, 0)) - index;
    const vec3 down = point_on(plane, eye, vec2(pixel) + vec2(0, 1)) - index;
#endif
#if HAS_LABELS
    if ((kSmooth & kSmoothLabels) != 0u) {
        const LabelPlace place = label_place(index);
        const vec3 origin = label_index(vec3(0.0));
        const vec3 x = label_index(across) - origin, y = label_index(down) - origin;
        const float slope = length(vec2(dot(place.slope, x), dot(place.slope, y)));
        const float depth = place.margin / max(slope, 1e-6); // pixels
        bool edge = false;
        const int looks =
            place.label != 0u && max(length(x), length(y)) * frame.outline_px > 0.5
                ? 8 // beyond these samples
                : 0;
        for (int i = 0; i < looks; ++i) {
            const vec3 beside = point_on(plane, eye, vec2(pixel) + frame.outline_px * sides[i]);
            edge = edge || label_place(beside).label != place.label;
        }
        const float mine =
            label_cover(place.label, depth, edge, frame.outline_px, frame.label_opacity);
        const float others =
            label_cover(place.other, 0.0, false, frame.outline_px, frame.label_opacity);
        color = mix(mix(color, styles[min(place.other, frame.style_count - 1u)].rgb, others),
                    mix(color, styles[min(place.label, frame.style_count - 1u)].rgb, mine),
                    min(0.5 + depth, 1.0));
    } else {
        const uint label = label_at(index);
        bool edge = false;
        for (int i = 0; i < 4; ++i) {
            const vec3 beside = point_on(plane, eye, vec2(pixel) + frame.outline_px * sides[i]);
            edge = edge || (frame.outline_px > 0.0 && label_at(beside) != label);
        }
        const float opacity = label == 0u ? 0.0 : edge ? 1.0 : frame.label_opacity;
        color = mix(color, styles[min(label, frame.style_count - 1u)].rgb, opacity);
    }
#endif
#if HAS_OVERLAY
    if ((kSmooth & kSmoothOverlay) != 0u) {
        const float outline_px = over.overlay_outline_px, fill = over.overlay_opacity;
        const LabelPlace place = overlay_place(index);
        const vec3 origin = overlay_index(vec3(0.0));
        const vec3 x = overlay_index(across) - origin, y = overlay_index(down) - origin;
        const float slope = length(vec2(dot(place.slope, x), dot(place.slope, y)));
        const float depth = place.margin / max(slope, 1e-6);
        bool rim = false;
        const int looks =
            place.label != 0u && max(length(x), length(y)) * outline_px > 0.5 ? 8 : 0;
        for (int i = 0; i < looks; ++i) {
            const vec3 beside = point_on(plane, eye, vec2(pixel) + outline_px * sides[i]);
            rim = rim || overlay_place(beside).label != place.label;
        }
        const float mine = label_cover(place.label, depth, rim, outline_px, fill);
        const float others = label_cover(place.other, 0.0, false, outline_px, fill);
        color = mix(mix(color, overlay_styles[min(place.other, over.overlay_styles - 1u)].rgb, others),
                    mix(color, overlay_styles[min(place.label, over.overlay_styles - 1u)].rgb, mine),
                    min(0.5 + depth, 1.0));
    } else {
        const uint more = overlay_at(index);
        bool rim = false;
        for (int i = 0; i < 4; ++i) {
            const vec3 beside = point_on(plane, eye, vec2(pixel) + over.overlay_outline_px * sides[i]);
            rim = rim || (over.overlay_outline_px > 0.0 && overlay_at(beside) != more);
        }
        const float cover = more == 0u ? 0.0 : rim ? 1.0 : over.overlay_opacity;
        color = mix(color, overlay_styles[min(more, over.overlay_styles - 1u)].rgb, cover);
    }
#endif
    if (all(lessThan(pixel, frame.size_px))) {
        imageStore(color_image, ivec3(pixel, gl_WorkGroupID.z),
                   hit ? vec4(color, 1.0) : vec4(frame.background, 0.0));
        imageStore(value_image, ivec3(pixel, gl_WorkGroupID.z),
                   hit ? vec4(value, max(nearest, 1e-6), 0.0, 0.0) : vec4(kNaN));
    }
}
