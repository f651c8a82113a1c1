// One see-through triangle in a ray's way, as the passes hand it on: 16 bytes a texel.

struct SurfaceLayer {
    vec4 color;  // lit; opacity in a
    float value; // NaN where there is none
    float depth; // mm along the ray; kNoLayer behind the last one
};

const float kNoLayer = 1e30;

SurfaceLayer no_layer() { return SurfaceLayer(vec4(0.0), uintBitsToFloat(0x7fc00000u), kNoLayer); }

uvec4 packed_layer(SurfaceLayer layer) {
    return uvec4(packUnorm2x16(layer.color.rg), packUnorm2x16(layer.color.ba),
                 floatBitsToUint(layer.value), floatBitsToUint(layer.depth));
}

SurfaceLayer unpacked_layer(uvec4 texel) {
    return SurfaceLayer(vec4(unpackUnorm2x16(texel.x), unpackUnorm2x16(texel.y)),
                        uintBitsToFloat(texel.z), uintBitsToFloat(texel.w));
}
