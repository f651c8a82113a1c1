#pragma once

#include <span>

#include "engine/base/error.h"
#include "engine/gpu/commands.h"
#include "engine/volume/changes.h"

namespace palpate {

// The samples of a volume in a 3D image, bit by bit, each in as many bits as the volume has it:
// floats by their bits, integers as whole numbers, signed ones raised by bias().
class SampleImage {
 public:
    // Fails with a sentence where the device has no image of the volume's size.
    static Result<void> fits(const GpuDevice& device, const Volume& volume);

    // Uploads all samples, some bricks at a time, and waits for it. Throws GpuError where memory
    // does not suffice, and what reading a brick of a source throws.
    SampleImage(GpuDevice& device, const Volume& volume);

    // Brings the changed blocks of `after` up, by copies recorded into `commands`.
    void bring_changes(Commands& commands, const Volume& after,
                       std::span<const ChangedBrick> changed);

    GpuImage& image() { return image_; }
    bool is_float() const { return type_ == ScalarType::f32; }
    int bias() const; // a texel less this is the sample

 private:
    ScalarType type_;
    GpuImage image_;
};

} // namespace palpate
