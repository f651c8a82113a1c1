#include "engine/render/stereo_layout.h"

#include <algorithm>

#include "engine/base/assert.h"

namespace palpate {

namespace {

void paste(const Image& from, Image& into, glm::uvec2 corner, uint32_t row_stride = 1) {
    const size_t row = size_t{from.size_px.x} * from.channels.size();
    for (uint32_t y = 0; y < from.size_px.y; y += row_stride)
        std::copy_n(&from.samples[y * row], row, &into.at(corner.x, corner.y + y, 0));
}

float luminance(const Image& image, uint32_t x, uint32_t y) {
    return 0.2126f * image.at(x, y, 0) + 0.7152f * image.at(x, y, 1) + 0.0722f * image.at(x, y, 2);
}

} // namespace

Image join_eyes(const Image& left, const Image& right, StereoLayout layout) {
    PALPATE_ASSERT(left.size_px == right.size_px && left.channels == right.channels);
    PALPATE_ASSERT(layout != StereoLayout::separate && left.channels.size() >= 3);
    const glm::uvec2 size = left.size_px;
    glm::uvec2 joint = size;
    if (layout == StereoLayout::side_by_side)
        joint.x *= 2;
    if (layout == StereoLayout::top_bottom)
        joint.y *= 2;
    Image image = make_image(joint, left.channels);
    switch (layout) {
        case StereoLayout::side_by_side:
            paste(left, image, {0, 0});
            paste(right, image, {size.x, 0});
            break;
        case StereoLayout::top_bottom:
            paste(left, image, {0, 0});
            paste(right, image, {0, size.y});
            break;
        case StereoLayout::row_interleaved:
            image = right;
            paste(left, image, {0, 0}, 2);
            break;
        default:
            for (uint32_t y = 0; y < size.y; ++y)
                for (uint32_t x = 0; x < size.x; ++x) {
                    image.at(x, y, 0) = luminance(left, x, y);
                    image.at(x, y, 1) = image.at(x, y, 2) = luminance(right, x, y);
                    if (left.channels.size() > 3)
                        image.at(x, y, 3) = std::max(left.at(x, y, 3), right.at(x, y, 3));
                }
    }
    return image;
}

} // namespace palpate
