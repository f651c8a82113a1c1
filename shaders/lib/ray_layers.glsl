// Rays among see-through meshes: marched from triangle to triangle, each blended in its turn.
// Included by ray_cast.comp with HAS_LAYERS. Distances are counted from where the lattice begins.

#include "shaders/lib/surface_layer.glsl"

SurfaceLayer layer_at(vec2 pixel, uint eye, uint number) {
    const int at = int(eye * kLayerCount + min(number, kLayerCount - 1u));
    const SurfaceLayer layer = unpacked_layer(texelFetch(surfaces, ivec3(uvec2(pixel), at), 0));
    if (number < kLayerCount)
        return layer;
    return no_layer();
}

// One thing seen before another; value and depth are those of the first that has any.
Marched then(Marched front, Marched behind) {
    return Marched(front.color + (1.0 - front.color.a) * behind.color,
                   isnan(front.value) ? behind.value : front.value,
                   isnan(front.depth) ? behind.depth : front.depth);
}

// A triangle at a distance, or nothing.
Marched marched_layer(SurfaceLayer layer, float depth, bool met) {
    const float opacity = met ? layer.color.a : 0.0;
    return Marched(opacity * vec4(layer.color.rgb, 1.0), met ? layer.value : kNaN,
                   met ? depth : kNaN);
}

Marched march_between(RaySampler s, vec2 t, vec2 span, bool marches, float cut) {
#if IS_ISO
    const Marched cap = cap_of(s, t.x, marches ? cut : 0.0);
    return over(cap, march(s, t, span, marches && cap.color.a < 1.0));
#else
    return march(s, t, span, marches);
#endif
}

// The picture that a ray sees from t.x to t.y behind `front`, with the triangles at distances from
// reach.x to below reach.y, also those outside of [t.x, t.y].
Marched march_layers(RaySampler s, vec2 t, vec2 reach, vec2 span, bool marches, float cut,
                     vec2 pixel, uint eye, float jitter, Marched front) {
    const float opaque = 1.0 - frame.min_transmittance;
    Marched seen = front;
    float from = t.x; // the next stretch begins here
    uint next = 0u;
    bool more = true;
    do {
        if (more) {
            const SurfaceLayer layer = layer_at(pixel, eye, next);
            const float depth = layer.depth + jitter;
            const vec2 part = vec2(from, min(t.y, depth));
            const bool goes = marches && part.x < part.y && seen.color.a <= opaque;
            seen = then(seen, march_between(s, goes ? part : vec2(t.x), span, goes,
                                            from == t.x ? cut : 0.0));
            more = layer.depth < kNoLayer && depth < reach.y;
            seen = then(seen, marched_layer(layer, depth, more && depth >= reach.x));
            from = max(from, depth);
            next += 1u;
        }
    } while (subgroupAny(more));
    return seen;
}

#if HAS_ATLAS
// The picture before this part of the volume, and how far along the ray it reaches.
Marched carried_layers(Carried front, bool wanted, out float reached) {
    const bool first = atlas.first_part != 0u || !wanted;
    reached = first ? 0.0 : front.values.z;
    return Marched(front.color, first ? kNaN : front.values.x, first ? kNaN : front.values.y);
}

void carry_layers(Marched seen, float reached, uvec2 place, uint eye, bool wanted) {
    const int layer = int(kCarryLayers * eye);
    if (wanted) {
        imageStore(carry_image, ivec3(place, layer), seen.color);
        imageStore(carry_image, ivec3(place, layer + 1), vec4(seen.value, seen.depth, reached, 0.0));
    }
}

// With the triangles beyond this part: what is seen if no other part follows.
Marched then_rest(Marched seen, float reached, vec2 pixel, uint eye, float jitter) {
    uint next = 0u;
    bool more = true;
    while (more) {
        const SurfaceLayer layer = layer_at(pixel, eye, next);
        const float depth = layer.depth + jitter;
        more = layer.depth < kNoLayer;
        seen = then(seen, marched_layer(layer, depth, more && depth >= reached));
        next += 1u;
    }
    return seen;
}
#endif
