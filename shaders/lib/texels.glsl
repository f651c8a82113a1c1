// Texels of the volume at index positions: by the device's sampler or by hand (kManual), from one
// image or, with HAS_ATLAS, from slots of an atlas (engine/render/brick_atlas.h). Needs `frame`,
// `volume` and, with HAS_ATLAS, `pages` and `atlas`.

#if HAS_ATLAS
// The page of the brick that a point lies in; `brick` becomes its first sample. Dividing by 32 is
// exact, and so is the sampler's choice of a texel hit in its middle.
vec4 page_at(vec3 index, out vec3 brick) {
    const vec3 number = floor(index * (1.0 / float(kAtlasBrickSide)));
    brick = number * float(kAtlasBrickSide);
    return textureLod(pages, (number + 0.5) * atlas.pages_texture, 0.0);
}
#endif

// The eight texels round a point, combined in fp32, in one order whatever holds them.
float texel_by_hand(vec3 index) {
    const vec3 p = clamp(index, vec3(0.0), frame.last);
    const vec3 low = min(floor(p), max(frame.last - 1.0, vec3(0.0)));
    precise const vec3 f = p - low;
#if HAS_ATLAS
    vec3 brick;
    const vec4 page = page_at(low, brick);
    const bool absent = page.x < kAbsentBrick;
    const ivec3 a = absent ? ivec3(0) : ivec3(low - brick + page.xyz);
    const ivec3 b = a + 1; // the end of the volume is repeated in the slot
#else
    const ivec3 a = ivec3(low);
    const ivec3 b = min(a + 1, ivec3(frame.last));
#endif
    const vec4 v0 = vec4(texelFetch(volume, a, 0).r,
                         texelFetch(volume, ivec3(a.x, b.y, a.z), 0).r,
                         texelFetch(volume, ivec3(a.x, a.y, b.z), 0).r,
                         texelFetch(volume, ivec3(a.x, b.y, b.z), 0).r);
    const vec4 v1 = vec4(texelFetch(volume, ivec3(b.x, a.y, a.z), 0).r,
                         texelFetch(volume, ivec3(b.x, b.y, a.z), 0).r,
                         texelFetch(volume, ivec3(b.x, a.y, b.z), 0).r,
                         texelFetch(volume, b, 0).r);
    precise const vec4 x = v0 + f.x * (v1 - v0);
    precise const vec2 y = x.xz + f.y * (x.yw - x.xz);
    precise const float z = y.x + f.z * (y.y - y.x);
#if HAS_ATLAS
    return absent ? page.w : z;
#else
    return z;
#endif
}

// By the device's sampler.
float texel_by_device(vec3 index) {
#if HAS_ATLAS
    const vec3 p = clamp(index, vec3(0.0), frame.last);
    vec3 brick;
    const vec4 page = page_at(p, brick);
    const vec3 local = clamp(p - brick, vec3(atlas.inset),
                             vec3(float(kAtlasBrickSide) - atlas.inset));
    const float texel = textureLod(volume, (local + page.xyz) * atlas.image_texture, 0.0).r;
    return page.x < kAbsentBrick ? page.w : texel;
#else
    return textureLod(volume, (index + 0.5) * frame.texture_from_index, 0.0).r;
#endif
}

// The texel at a point of the sampled box. Of a brick that is not resident: one of its own, which
// shows as little as all of its others (engine/render/residency.h).
float texel_at_index(vec3 index) {
    float texel;
    if (kManual != 0u)
        texel = texel_by_hand(index);
    else
        texel = texel_by_device(index);
    return texel;
}

// The texel of a sample, by its number on each axis.
float stored_texel(ivec3 at) {
    const ivec3 inside = clamp(at, ivec3(0), ivec3(frame.last));
#if HAS_ATLAS
    vec3 brick;
    const vec4 page = page_at(vec3(inside), brick);
    const bool absent = page.x < kAbsentBrick;
    const ivec3 place = absent ? ivec3(0) : inside - ivec3(brick) + ivec3(page.xyz);
    const float texel = texelFetch(volume, place, 0).r;
    return absent ? page.w : texel;
#else
    return texelFetch(volume, inside, 0).r;
#endif
}
