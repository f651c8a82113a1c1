#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "apps/view/window/panel.h"
#include "engine/render/display_pass.h"

namespace palpate::view {

// A view's picture as its screen shows it: 4 bytes a pixel (R, G, B, A), row 0 at the top.
struct Picture {
    Panel panel = Panel::axial;
    glm::uvec2 size_px{0};
    std::shared_ptr<GpuImage> image; // on the device, to be used after `ready`; or null, and
    std::vector<std::byte> rgba{};   // the bytes
    SemaphoreUse ready{VK_NULL_HANDLE};
    double ms = 0;             // that drawing it took
    double error_estimate = 0; // RMSE of colours, 1 is white; 0 when it is complete
    bool complete = true;
    int64_t newest_input_ns = 0; // EditState: of the document that it shows
    int64_t made_ns = 0;         // when it was there, by profile::now_ns()
};

// Renderers' pictures laid out for the screen, into images that are used again as soon as nobody
// holds them, or as bytes. Of an image that is used again only the pixels are written that have
// changed since, where a pixel of the screen is one of an eye's picture.
class PictureImages {
 public:
    // stay: on the device.
    PictureImages(GpuDevice& device, bool stay) : device_(&device), pass_(device), stay_(stay) {}

    GpuDevice& device() { return *device_; }

    struct Frame {
        Panel panel;
        GpuImage* eyes; // RecordedFrame::picture
        const DisplayLayout& display;
    };
    // The renderer's picture has changed in these pixels, or in none that is known. Said before
    // finish(), for each picture that a panel had since.
    void changed(Panel panel, const std::optional<PixelBox>& pixels = {});
    // Records their layouts, submits the commands, waits for them and returns the pictures.
    std::vector<Picture> finish(Commands& commands, std::span<const Frame> frames);

 private:
    struct Held {
        std::shared_ptr<GpuImage> image;
        DisplayLayout display; // that it shows
        PixelBox stale;        // where it shows an older picture
    };
    Held& image_for(Panel panel, glm::uvec2 size_px);

    GpuDevice* device_;
    DisplayPass pass_;
    bool stay_;
    // The images of each panel. They go on this thread: another one's reference is never the last.
    std::array<std::vector<Held>, kPanels.size()> images_;
};

} // namespace palpate::view
