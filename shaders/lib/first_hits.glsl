// Iso-surfaces of a picture from fewer rays: the rays of every second pixel leave the distance of what
// they meet first, in mm, and 0 where they meet nothing. A listed ray begins a little before the
// nearest hit of the rays about it instead of where its tile begins. It is the same ray to the bit,
// unless it would have met, and left again before that place, something nearer than all of them:
// thinner than two pixels. Included by ray_cast.comp.

const float kStepsBeforeHit = 2.0; // of 1.5 to 6 steps all take much the same time (docs/log/rendering.md)

uint first_hit_number(uvec2 second_pixel, uint eye) {
    const uvec2 count = (frame.size_px + 1u) / 2u;
    return (eye * count.y + second_pixel.y) * count.x + second_pixel.x;
}

void leave_first_hit(uvec2 pixel, uint eye, float depth) {
    first_hits[first_hit_number(pixel / 2u, eye)] = isnan(depth) ? 0.0 : depth;
}

// 0 where none of the rays about a pixel meets anything, or where there is none on its other side.
float nearest_hit_about(uvec2 pixel, uint eye) {
    const uvec2 low = pixel / 2u;
    const uvec2 high = (pixel + 1u) / 2u;
    if (any(greaterThan(high, (frame.size_px - 1u) / 2u)))
        return 0.0;
    const vec4 about = vec4(first_hits[first_hit_number(low, eye)],
                            first_hits[first_hit_number(uvec2(high.x, low.y), eye)],
                            first_hits[first_hit_number(uvec2(low.x, high.y), eye)],
                            first_hits[first_hit_number(high, eye)]);
    const float none = 3.4e38;
    const vec4 hits = mix(vec4(none), about, greaterThan(about, vec4(0.0)));
    const float nearest = min(min(hits.x, hits.y), min(hits.z, hits.w));
    return nearest < none ? nearest : 0.0;
}
