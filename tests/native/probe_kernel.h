#pragma once

#include <cstddef>
#include <cstdint>

// Words that the kernel of seen.comp writes, about the images that its launch was given.
namespace palpate::native_probe {

enum Told : size_t {
    kVolumeWidth,
    kVolumeHeight,
    kVolumeDepth,
    kVolumeIsLinear,
    kVolumeIsClampedToBorder,
    kVolumeLast, // the value of its last texel, by the strides
    kPictureWidth,
    kPictureHeight,
    kPictureLayers,
    kPictureIsArray,
    kPictureLast, // likewise, of its fourth channel
    kTold
};

} // namespace palpate::native_probe
