#pragma once

#include <optional>

#include "engine/gpu/commands.h"
#include "engine/render/changed_pixels.h"
#include "engine/render/display_layout.h"

namespace palpate {

// The last pass of a frame: lays the eyes' pictures out for a screen and turns their display values
// into 8 bits a channel, on the device. Gives the bytes of display_image() and display_byte().
class DisplayPass {
 public:
    explicit DisplayPass(GpuDevice& device);

    // An image that record() can write to and a window can show or copy: rgba8.
    static GpuImage make_target(GpuDevice& device, std::string name, glm::uvec2 size_px);

    struct Target {
        GpuImage& image;
        glm::uvec2 corner_px{0}; // where the joint picture's top left pixel goes; all of it fits
        bool bgra = false;       // red and blue change places, for a window of format BGRA
        std::optional<PixelBox> only{}; // of the joint picture, within it; none: all of it
    };
    // `picture` is the renderer's: RGBA in display values, a layer an eye, one or two. The target
    // is written where the joint picture, or `only` that part of it, lies, with alpha 1, and
    // elsewhere kept.
    void record(Commands& commands, GpuImage& picture, const DisplayLayout& display,
                const Target& target);

 private:
    GpuDevice* device_;
    ComputePipeline pipeline_;
    std::optional<ComputePipeline> with_marks_; // made for the first that are shown
    Sampler nearest_;
};

} // namespace palpate
