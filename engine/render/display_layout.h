#pragma once

#include <span>

#include "engine/image/image.h"
#include "engine/scene/scene.h"

namespace palpate {

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
    // Of the picture's top left pixel on the screen. Rows and columns are counted from the
    // screen's, so that a window that moves by one pixel shows each eye where it did. May be
    // negative.
    glm::ivec2 origin_px{0};
};

// As a scene asks; `left` where it has one eye.
DisplayLayout display_layout(const Scene& scene);

// The size of the joint picture, of eyes' pictures of this size.
glm::uvec2 display_size_px(glm::uvec2 eye_px, StereoLayout layout);

// One or two eyes' pictures of one size as one: left, then right. One eye is shown to both. Every
// channel comes along, but an anaglyph's others than R, G, B and A are NaN. The twin on the CPU of
// DisplayPass.
Image display_image(std::span<const Image> eyes, const DisplayLayout& display);

} // namespace palpate
