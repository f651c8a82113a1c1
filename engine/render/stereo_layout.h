#pragma once

#include "engine/image/image.h"
#include "engine/scene/scene.h"

namespace palpate {

// Two eyes' pictures of one size as one. Colour channels only ("R", "G", "B", "A").
//
// side_by_side: left eye on the left, twice as wide. top_bottom: left eye on top, twice as high.
// row_interleaved: even rows (0 is the top) show the left eye, odd rows the right. anaglyph: the
// left eye's luminance in red, the right eye's in green and blue. separate has no joint picture.
Image join_eyes(const Image& left, const Image& right, StereoLayout layout);

} // namespace palpate
