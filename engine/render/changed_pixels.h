#pragma once

#include <glm/glm.hpp>

#include "engine/scene/scene.h"

namespace palpate {

// Pixels from `low` on and before `high`, across and down; none where low is not below high.
struct PixelBox {
    glm::uvec2 low{0}, high{0};
    bool empty() const { return low.x >= high.x || low.y >= high.y; }
    uint64_t count() const { return empty() ? 0 : uint64_t{high.x - low.x} * (high.y - low.y); }
    friend bool operator==(const PixelBox&, const PixelBox&) = default;
};
PixelBox united(const PixelBox& a, const PixelBox& b);
// With all pixels of the tiles that it touches, in a picture of this size.
PixelBox of_whole_tiles(const PixelBox& box, glm::uvec2 size_px);

// A box of pixels outside of which a scene's picture, in each of its eyes, stays the same when its
// volume or its label map changes from `before` to `after`: about all changed samples that its
// rays, or else its slices, pass within the reach of interpolation and gradients. All pixels where
// the two are of another size, grid or type, or a live surface follows the volume. Walls between
// live labels move with them, so far as smoothing reaches. Meshes are not looked at (seen_box.h).
PixelBox changed_pixels(const Scene& scene, const Volume& before, const Volume& after);

} // namespace palpate
