#pragma once

#include <span>
#include <vector>

#include "engine/image/image.h"
#include "engine/scene/scene.h"
#include "shaders/shared/display.h"

namespace palpate {

// A spot over one eye's picture: 3D cursors are one for each eye. All of `color` out to a pixel and
// a half within the rim, none from a pixel and a half beyond it, so that its centroid is its middle
// to 0.03 pixels also where a layout shows every second one (for a radius of 2.5 pixels and more).
struct EyeMark {
    uint32_t eye = 0;          // 0: left, 1: right; eyes of scenes with one are 0
    glm::vec2 at_px{0.0f};     // in the eye's picture; (x, y) is the middle of pixel (x, y)
    glm::vec2 radius_px{5.0f}; // on either axis; > 0
    glm::vec3 color{1.0f};
    float opacity = 1.0f; // 0 .. 1

    friend bool operator==(const EyeMark&, const EyeMark&) = default;
};
constexpr size_t kMaxEyeMarks = 16;

// How the pictures of one or two eyes lie on a screen.
//
// left, right: that eye alone. side_by_side: the left eye on the left, twice as wide. top_bottom:
// the left eye on top, twice as high. row_interleaved, column_interleaved, checkerboard: a pixel
// shows the left eye where its row, its column or their sum is even, and the right eye elsewhere.
// anaglyph: the left eye's luminance in red, the right eye's in green and blue. separate is two
// files, and no layout of one picture.
struct DisplayLayout {
    StereoLayout layout = StereoLayout::left;
    bool swap_eyes = false; // each eye is shown in place of the other
    bool mirror = false;    // each eye's picture is upside down, for a screen seen in a mirror
    // The place of the picture's top left pixel on the screen. Rows and columns are counted from
    // the screen's, so that a window that moves by one pixel shows each eye where it did. May be
    // negative.
    glm::ivec2 origin_px{0};
    std::vector<EyeMark> marks{}; // at most kMaxEyeMarks; the later ones over those before

    friend bool operator==(const DisplayLayout&, const DisplayLayout&) = default;
};

// For the device.
gpu::DisplayMark mark_block(const EyeMark& mark);

// As a scene asks; `left` where it has one eye.
DisplayLayout display_layout(const Scene& scene);

// The size of the joint picture, of eyes' pictures of this size.
glm::uvec2 display_size_px(glm::uvec2 eye_px, StereoLayout layout);

// One or two eyes' pictures of one size as one: left, then right. One eye is shown to both. Every
// channel comes along, but an anaglyph's others than R, G, B and A are NaN. The twin on the CPU of
// DisplayPass.
Image display_image(std::span<const Image> eyes, const DisplayLayout& display);

} // namespace palpate
