#include "engine/render/display_layout.h"

#include <algorithm>
#include <limits>

#include "engine/base/assert.h"

namespace palpate {

namespace {

// Which eye a pixel of the joint picture shows, and which of its pixels; not of an anaglyph.
struct Shown {
    uint32_t eye;
    glm::uvec2 pixel;
};

Shown shown_at(glm::uvec2 pixel, glm::uvec2 eye_px, const DisplayLayout& display) {
    const glm::uvec2 on_screen(glm::ivec2(pixel) + display.origin_px);
    switch (display.layout) {
        case StereoLayout::side_by_side:
            return {pixel.x / eye_px.x, {pixel.x % eye_px.x, pixel.y}};
        case StereoLayout::top_bottom:
            return {pixel.y / eye_px.y, {pixel.x, pixel.y % eye_px.y}};
        case StereoLayout::row_interleaved:
            return {on_screen.y % 2, pixel};
        case StereoLayout::column_interleaved:
            return {on_screen.x % 2, pixel};
        case StereoLayout::checkerboard:
            return {(on_screen.x + on_screen.y) % 2, pixel};
        default:
            return {display.layout == StereoLayout::right, pixel};
    }
}

float luminance(const float* pixel) {
    return 0.2126f * pixel[0] + 0.7152f * pixel[1] + 0.0722f * pixel[2];
}

} // namespace

gpu::DisplayMark mark_block(const EyeMark& mark) {
    constexpr float kSoft_px = 1.5f;
    const float soft = kSoft_px / std::min(mark.radius_px.x, mark.radius_px.y);
    const float inner = std::max(1.0f - soft, 0.0f), outer = 1.0f + soft;
    return {.at = mark.at_px,
            .scale = 1.0f / mark.radius_px,
            .outer = outer * outer,
            .inverse = 1.0f / (outer * outer - inner * inner),
            .color = mark.color,
            .opacity = mark.opacity,
            .eye = mark.eye};
}

DisplayLayout display_layout(const Scene& scene) {
    DisplayLayout display{.mirror = scene.mirror};
    if (scene.stereo) {
        display.layout = scene.stereo->layout;
        display.swap_eyes = scene.stereo->swap_eyes;
    }
    return display;
}

glm::uvec2 display_size_px(glm::uvec2 eye_px, StereoLayout layout) {
    return eye_px * glm::uvec2(layout == StereoLayout::side_by_side ? 2 : 1,
                               layout == StereoLayout::top_bottom ? 2 : 1);
}

Image display_image(std::span<const Image> eyes, const DisplayLayout& display) {
    PALPATE_ASSERT(!eyes.empty() && eyes.size() <= 2);
    PALPATE_ASSERT(eyes.front().size_px == eyes.back().size_px &&
                   eyes.front().channels == eyes.back().channels);
    PALPATE_ASSERT(display.layout != StereoLayout::separate);
    PALPATE_ASSERT_CMP(display.marks.size(), <=, kMaxEyeMarks);
    PALPATE_ASSERT(display.layout != StereoLayout::anaglyph || eyes.front().channels.size() >= 3);
    const glm::uvec2 eye_px = eyes.front().size_px;
    const size_t channels = eyes.front().channels.size();
    // The samples of an eye's pixel.
    std::vector<gpu::DisplayMark> marks;
    for (const EyeMark& mark : display.marks)
        marks.push_back(mark_block(mark));
    std::vector<float> marked[2] = {std::vector<float>(channels), std::vector<float>(channels)};
    const auto pixel_of = [&](const Shown& shown) -> const float* {
        const uint32_t y = display.mirror ? eye_px.y - 1 - shown.pixel.y : shown.pixel.y;
        const uint32_t eye = std::min<uint32_t>(display.swap_eyes ? 1 - shown.eye : shown.eye,
                                                static_cast<uint32_t>(eyes.size()) - 1);
        const float* from = &eyes[eye].samples[(size_t{y} * eye_px.x + shown.pixel.x) * channels];
        if (marks.empty() || channels < 3)
            return from;
        std::vector<float>& to = marked[shown.eye];
        to.assign(from, from + channels);
        for (const gpu::DisplayMark& mark : marks) {
            const glm::vec2 arm = (glm::vec2(shown.pixel.x, y) - mark.at) * mark.scale;
            const float q = arm.x * arm.x + arm.y * arm.y;
            const float t = std::clamp((mark.outer - q) * mark.inverse, 0.0f, 1.0f);
            const float weight = t * t * (3.0f - 2.0f * t) * mark.opacity;
            if (mark.eye == eye && weight > 0.0f)
                for (size_t c = 0; c < 3; ++c)
                    to[c] = to[c] + weight * (mark.color[static_cast<glm::length_t>(c)] - to[c]);
        }
        return to.data();
    };
    Image joint = make_image(display_size_px(eye_px, display.layout), eyes.front().channels);
    float* out = joint.samples.data();
    for (uint32_t y = 0; y < joint.size_px.y; ++y)
        for (uint32_t x = 0; x < joint.size_px.x; ++x, out += channels) {
            if (display.layout != StereoLayout::anaglyph) {
                std::copy_n(pixel_of(shown_at({x, y}, eye_px, display)), channels, out);
                continue;
            }
            const float *const left = pixel_of({0, {x, y}}), *const right = pixel_of({1, {x, y}});
            out[0] = luminance(left);
            out[1] = out[2] = luminance(right);
            if (channels > 3)
                out[3] = std::max(left[3], right[3]);
            std::fill(out + std::min<size_t>(4, channels), out + channels,
                      std::numeric_limits<float>::quiet_NaN());
        }
    return joint;
}

} // namespace palpate
