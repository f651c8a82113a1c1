// A volume that lies in an atlas may be marched in parts, boxes of bricks, front to back. What rays
// have gathered is carried from part to part. Included by ray_cast.comp with HAS_ATLAS.

// The distances between which a ray is in the part; x >= y where it never is. A plane between two
// parts gives the same number for both.
vec2 part_of_ray(Ray ray) {
    const vec3 size = abs(ray.direction);
    const float negligible = 1e-9 * max(size.x, max(size.y, size.z));
    const bvec3 along = greaterThan(size, vec3(negligible));
    precise const vec3 inverse = 1.0 / mix(vec3(1.0), ray.direction, along);
    precise const vec3 a = (atlas.part_low - ray.origin) * inverse;
    precise const vec3 b = (atlas.part_high - ray.origin) * inverse;
    const bvec3 within = bvec3(ivec3(greaterThanEqual(ray.origin, atlas.part_low)) &
                               ivec3(lessThan(ray.origin, atlas.part_high)));
    const vec3 always = mix(vec3(1e30), vec3(-1e30), within);
    const vec3 near = mix(always, min(a, b), along);
    const vec3 far = mix(-always, max(a, b), along);
    return vec2(max(near.x, max(near.y, near.z)), min(far.x, min(far.y, far.z)));
}

// Cuts a stretch of the ray to the part, at nodes of the lattice (surfaces: at middles of its
// segments; integrator exact: at the faces themselves): so all parts together take the samples that one would.
vec2 clip_to_part(Ray ray, uint eye, vec2 t) {
    const vec2 part = part_of_ray(ray);
    const float h = frame.step;
    vec2 cut = part;
#if !IS_EXACT
    const vec2 k = ceil(part / h - 0.5); // segments k.x .. k.y - 1 have their middle within
    cut = (IS_ISO != 0 ? k - 0.5 : k) * h;
    // Dividing by h gives k again, and not a segment of no length beside it.
    const uint ulps = IS_ISO != 0 ? 0u : 2u;
    cut.x = cut.x > 0.0 && floor(cut.x / h) < k.x
                ? uintBitsToFloat(floatBitsToUint(cut.x) + ulps) : cut.x;
    cut.y = cut.y > 0.0 && ceil(cut.y / h) > k.y
                ? uintBitsToFloat(floatBitsToUint(cut.y) - ulps) : cut.y;
#endif
    const bool mine = (atlas.part_eyes >> eye & 1u) != 0u;
    return mine && part.x < part.y ? vec2(max(t.x, cut.x), min(t.y, cut.y)) : vec2(1.0, 0.0);
}

vec4 no_values() {
#if IS_ISO
    return vec4(kNaN);
#else
    return vec4(kNoTexel);
#endif
}

struct Carried {
    vec4 color;  // premultiplied; a is what is hidden
    vec4 values; // MIP: the highest texel; iso: value and depth of the first hit
};

Carried carried(uvec2 place, uint eye, bool wanted) {
    const int layer = int(kCarryLayers * eye);
    Carried c = Carried(vec4(0.0), no_values());
    if (wanted && atlas.first_part == 0u)
        c = Carried(imageLoad(carry_image, ivec3(place, layer)),
                    imageLoad(carry_image, ivec3(place, layer + 1)));
    return c;
}

// Whether nothing further can be seen behind.
bool is_opaque(Carried front) {
    const bool mip = IS_ISO == 0 && kMode == kModeMip;
    return !mip && front.color.a > 1.0 - frame.min_transmittance;
}

// Joins what is in front and what this part adds.
Marched carry_on(Carried front, Marched part, uvec2 place, uint eye, bool wanted) {
    Marched both = part;
    vec4 values = front.values;
#if IS_ISO
    values.xy = isnan(front.values.y) ? vec2(part.value, part.depth) : front.values.xy;
    both.value = values.x;
    both.depth = values.y;
#else
    if (kMode == kModeMip) {
        values.x = max(front.values.x, highest_texel);
        both = mip_of(values.x);
    }
#endif
    if (IS_ISO != 0 || kMode != kModeMip)
        both.color = front.color + (1.0 - front.color.a) * part.color;
    const int layer = int(kCarryLayers * eye);
    if (wanted) {
        imageStore(carry_image, ivec3(place, layer), both.color);
        imageStore(carry_image, ivec3(place, layer + 1), values);
    }
    return both;
}
