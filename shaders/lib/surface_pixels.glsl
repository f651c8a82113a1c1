// Which of the pixels that are drawn something covers. Needs lib/surface.glsl.

// The pixels whose centres lie between two points of the image plane: the first, and the last.
ivec4 pixels_between(vec2 low, vec2 high) {
    const vec2 per_pixel = vec2(frame.size_px) / (frame.bounds.yz - frame.bounds.xw); // y < 0
    const vec2 a = (low - frame.bounds.xw) * per_pixel - 0.5;
    const vec2 b = (high - frame.bounds.xw) * per_pixel - 0.5;
    // Rounding moves a point on the picture by less than 2^14 pixels * 2^-21.
    const float slack = 1.0 / 64.0;
    const vec2 least = vec2(frame.low_px), most = vec2(frame.low_px + frame.part_px);
    const vec2 first = clamp(ceil(min(a, b) - slack), least, most);
    const vec2 last = clamp(floor(max(a, b) + slack), least - 1.0, most - 1.0);
    return ivec4(ivec2(first), ivec2(last));
}

vec2 projected(vec3 p) { return frame.orthographic != 0u ? p.xy : p.xy / p.z; }
