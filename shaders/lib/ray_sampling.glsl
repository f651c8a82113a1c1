// Samples along a ray: values, table entries, labels, gradients. Included by ray_cast.comp.

// A ray in texture space, so that a sample costs one multiplication and one addition per axis.
struct RaySampler {
    vec3 origin;     // texture coordinates
    vec3 direction;  // texture coordinates per mm
    Ray ray;         // index space
    CellRay cells;
};

RaySampler ray_sampler(Ray ray) {
    RaySampler s;
    s.origin = (ray.origin + 0.5) * frame.texture_from_index;
    s.direction = ray.direction * frame.texture_from_index;
    s.ray = ray;
    s.cells = cell_ray(ray);
    return s;
}

// The texel at distance t; its value is texel * value_scale + value_bias. Loops stay in texels.
float texel_at(RaySampler s, float t) {
    if (kCount != 0u)
        samples_taken += 1u;
    float texel;
    if (HAS_ATLAS != 0 || kManual != 0u)
        texel = texel_at_index(s.ray.origin + t * s.ray.direction);
    else
        texel = textureLod(volume, s.origin + t * s.direction, 0.0).r;
    return texel;
}

#if !IS_ISO
// The table's entry nearest to a texel's value; the sampler clamps to the ends.
vec4 table_entry(float texel, uint row) {
    return textureLod(table, vec2(texel * frame.table_scale + frame.table_bias, float(row)), 0.0);
}

// Position of a texel in the table, in entries: 0 is the first, kTableEntries - 1 the last.
float table_position(float texel) {
    return (texel * frame.table_scale + frame.table_bias) * float(kTableEntries) - 0.5;
}

// Running integral of the table at a position, in units of one entry's width; beyond the ends it
// goes on with the end entries. Interpolated here and not by the sampler, whose weights have 8 bits
// on most devices.
vec4 table_integral(float position) {
    const float n = float(kTableEntries);
    const float inside = clamp(position, 0.0, n - 1.0);
    const float low = min(floor(inside), n - 2.0);
    const float row = float(kTableRowIntegral);
    const vec4 a = textureLod(table, vec2((low + 0.5) / n, row), 0.0);
    const vec4 b = textureLod(table, vec2((low + 1.5) / n, row), 0.0);
    const vec4 end = position < 0.0 ? frame.table_first : frame.table_last;
    return a + (inside - low) * (b - a) + (position - inside) * end;
}
#endif

#if HAS_LABELS
// The style of the label at a point of the ray: rgb and how far it tints (0 for background);
// a negative tint means "not shown".
vec4 label_tint(RaySampler s, float t) {
    const vec3 index = s.ray.origin + t * s.ray.direction;
    const uint label =
        textureLod(labels, frame.label_from_index * index + frame.label_origin, 0.0).r;
    const vec4 style = styles[min(label, frame.style_count - 1u)];
    const float weight = style.a > 0.0 ? frame.label_weight : -1.0;
    return vec4(style.rgb, label == 0u ? 0.0 : weight);
}
#endif

// Differences of the texel one sample to each side, positions clamped to the box.
vec3 differences_by_index(vec3 index) {
    const vec3 p = clamp(index, vec3(0.0), frame.last);
    const vec3 a = max(p - 1.0, vec3(0.0));
    const vec3 b = min(p + 1.0, frame.last);
    return vec3(texel_at_index(vec3(b.x, p.yz)) - texel_at_index(vec3(a.x, p.yz)),
                texel_at_index(vec3(p.x, b.y, p.z)) - texel_at_index(vec3(p.x, a.y, p.z)),
                texel_at_index(vec3(p.xy, b.z)) - texel_at_index(vec3(p.xy, a.z)));
}

// The same of an image, by texture coordinates.
vec3 differences_by_texture(vec3 texture) {
    const vec3 low = 0.5 * frame.texture_from_index;
    const vec3 high = 1.0 - low;
    const vec3 h = frame.texture_from_index;
    const vec3 p = clamp(texture, low, high);
    const vec3 a = max(p - h, low);
    const vec3 b = min(p + h, high);
    return vec3(textureLod(volume, vec3(b.x, p.y, p.z), 0.0).r -
                    textureLod(volume, vec3(a.x, p.y, p.z), 0.0).r,
                textureLod(volume, vec3(p.x, b.y, p.z), 0.0).r -
                    textureLod(volume, vec3(p.x, a.y, p.z), 0.0).r,
                textureLod(volume, vec3(p.x, p.y, b.z), 0.0).r -
                    textureLod(volume, vec3(p.x, p.y, a.z), 0.0).r);
}

// Differences of the value one sample to each side, per sample; stored ones with a scale of their own.
vec3 gradient_index_at(RaySampler s, float t) {
    vec3 g;
#if !IS_ISO
    if (kStored != 0u)
        return textureLod(gradients, s.origin + t * s.direction, 0.0).xyz;
#endif
    if (HAS_ATLAS != 0 || kManual != 0u)
        g = differences_by_index(s.ray.origin + t * s.ray.direction);
    else
        g = differences_by_texture(s.origin + t * s.direction);
    return 0.5 * frame.value_scale * g;
}

// Blinn-Phong with the light at the eye: light, view and half vector are one. Both sides are lit.
// `facing` is the cosine between the normal and the ray.
vec3 lit(vec3 color, float facing) {
    const float spec = frame.shading.z * pow(facing, frame.shading.w);
    return clamp(color * (frame.shading.x + frame.shading.y * facing) + spec, 0.0, 1.0);
}

// The same with a light elsewhere. `normal` is any covector of this size, in index space; the side
// that the ray comes from is seen. Highlights fade out before the side turned away begins.
vec3 lit_from_light(vec3 color, vec3 normal, float size, vec3 direction) {
    const float along = dot(normal, direction);
    const float to_eye = along > 0.0 ? -1.0 : 1.0;
    const float light_along = dot(frame.light_covector, direction);
    const float half_size = sqrt(max(2.0 - 2.0 * light_along, 1e-12));
    const bool has_normal = size > 0.0; // else it faces the eye
    const float scale = has_normal ? to_eye / size : 0.0;
    const float light = dot(normal, frame.light_index);
    const float to_light = has_normal ? min(scale * light, 1.0) : -light_along;
    const float to_half = has_normal ? scale * (light - along) / half_size : 0.5 * half_size;
    const float spec = frame.shading.z * clamp(kHighlightFade * to_light, 0.0, 1.0) *
                       pow(clamp(to_half, 0.0, 1.0), frame.shading.w);
    const float diffuse = frame.shading.x + frame.shading.y * max(to_light, 0.0);
    return clamp(color * diffuse + spec, 0.0, 1.0);
}

// The colour lit by the gradient at distance t.
// The product of a covector and a direction is the same in index space and in world; only the
// covector's length needs the world.
vec3 shade(vec3 color, RaySampler s, float t) {
    const vec3 g = gradient_index_at(s, t);
    const vec3 g_world = frame.world_from_index_covector * g;
    const float size = length(g_world);
    if (kLight != 0u)
        return lit_from_light(color, g, size, s.ray.direction);
    float facing = abs(dot(g, s.ray.direction)) / (size > 0.0 ? size : 1.0);
    return lit(color, size > 0.0 ? min(facing, 1.0) : 1.0); // also where a neighbour has no data
}

#if IS_ISO
#include "shaders/lib/occlusion.glsl"

// The same on an iso-surface.
vec3 shade_surface(vec3 color, RaySampler s, float t, float iso) {
    const vec3 seen = shade(color, s, t);
    if (kOcclusion != 0u)
        return openness(s, t, iso) * seen;
    return seen;
}
#endif
