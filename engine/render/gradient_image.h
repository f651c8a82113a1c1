#pragma once

#include <span>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/render/residency.h"
#include "engine/volume/changes.h"
#include "engine/volume/volume.h"

namespace palpate {

// The central differences of a volume at every sample, as one 3D image beside the volume's own:
// shading then takes one sample and not six.
//
// A texel is the value one sample ahead less the one behind, on each index axis, positions clamped
// to the box: the sampler gives between samples what differences of interpolated values are there.
// Scaled to fit RGBA16F; shading needs their direction alone. Each is rounded to
// 11 bits, or to 0 below 2^-14; NaN where a sample is. Bricks are filled when they are asked for.
class GradientImage {
 public:
    GradientImage(GpuDevice& device, const Volume& volume);

    static uint64_t bytes_for(const Volume& volume); // of the image and its staging

    // Fills those of the wanted bricks (and what interpolation reads beside them) that are not;
    // how many were filled. For the snapshot told last.
    size_t fill(const BrickMask& wanted, Commands& commands);

    // Holds a later snapshot of the same size and type; what reads a changed sample is to be
    // filled anew.
    void update(const Volume& next, std::span<const ChangedBrick> changed);

    GpuImage& image() { return image_; }
    const Volume& snapshot() const { return snapshot_; }

 private:
    Volume snapshot_;
    float span_; // of values, that the scale is for
    BrickMask filled_;
    GpuImage image_;
};

// One brick's texels, x fastest: four halves each, the last of them 0.
void store_gradients(const Volume& volume, glm::uvec3 brick, float scale, uint16_t* out);

} // namespace palpate
