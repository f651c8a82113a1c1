#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

#include "engine/render/residency.h"
#include "engine/render/texel_storage.h"
#include "engine/surface_gpu/block_maker.h"

namespace palpate {

// Who interpolates between samples.
enum class Sampling {
    device,  // its sampler: fast; positions are rounded to a few units in their last place, and on
             // most graphics cards weights to 8 bits
    by_hand, // the shader, in fp32 and in one order: the same bits as one image and in an atlas
             // that is marched at once (in parts, rays may end within min_transmittance of there)
};

struct RendererOptions {
    TexelFormat volume_format = TexelFormat::automatic;
    // For all that is kept on the device; 0 is three quarters of the device's memory. Mapped memory
    // that uploads and read-backs travel through does not count: mostly one to three times 4 MiB,
    // and what a picture takes that is read back.
    uint64_t memory_limit_bytes = 0;
    bool skipping = true; // jump over empty space; changes no bit of a picture
    Residency residency = Residency::automatic;
    size_t most_resident_bricks = 0; // of an atlas, beside what fits; 0: no other limit
    Sampling sampling = Sampling::device;
    // >= 1: record() waits until the device is past the frame so many before.
    size_t frames_in_flight = 2;
    // Shaded alpha: keep the gradients beside a dense volume (8 bytes a sample), where that fits,
    // so that shading takes one sample and not six. Filling it takes as long as some frames.
    // Colours differ by up to 1e-3, because gradients are then rounded to 11 bits.
    bool stored_gradients = false;
    // Makes the blocks of live surfaces; none: the CPU where the device stands for it, or cannot.
    std::optional<BlockMaker> block_maker{};
    // Called while a frame is drawn in several parts, with the share that is done; false stops it.
    std::function<bool(double share)> progress;
};

} // namespace palpate
