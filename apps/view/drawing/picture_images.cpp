#include "apps/view/drawing/picture_images.h"

#include "engine/base/profile.h"

namespace palpate::view {

PictureImages::Held& PictureImages::image_for(Panel panel, glm::uvec2 size_px) {
    auto& images = images_[static_cast<size_t>(panel)];
    std::erase_if(images, [&](const Held& held) {
        return held.image.use_count() == 1 && glm::uvec2(held.image->shape().size) != size_px;
    });
    for (Held& held : images)
        if (held.image.use_count() == 1)
            return held;
    return images.emplace_back(std::make_shared<GpuImage>(DisplayPass::make_target(
                                   *device_, std::string("picture of ") + name_of(panel), size_px)),
                               DisplayLayout{}, PixelBox{glm::uvec2(0), size_px});
}

void PictureImages::changed(Panel panel, const std::optional<PixelBox>& pixels) {
    for (Held& held : images_[static_cast<size_t>(panel)]) {
        const PixelBox all{glm::uvec2(0), glm::uvec2(held.image->shape().size)};
        held.stale = pixels ? united(held.stale, *pixels) : all;
    }
}

namespace {

// Whether a pixel of the screen is the same one of an eye's picture.
bool shows_pixel_by_pixel(const DisplayLayout& display) {
    return !display.mirror &&
           (display.layout == StereoLayout::left || display.layout == StereoLayout::right);
}

} // namespace

std::vector<Picture> PictureImages::finish(Commands& commands, std::span<const Frame> frames) {
    const profile::Scope scope("display");
    std::vector<Picture> pictures;
    std::vector<BufferSlice> bytes;
    for (const Frame& frame : frames) {
        const glm::uvec2 size_px =
            display_size_px(glm::uvec2(frame.eyes->shape().size), frame.display.layout);
        Held& held = image_for(frame.panel, size_px);
        if (held.display != frame.display || !shows_pixel_by_pixel(frame.display))
            held.stale = {glm::uvec2(0), size_px};
        if (!held.stale.empty())
            pass_.record(commands, *frame.eyes, frame.display,
                         {.image = *held.image, .only = held.stale});
        held.display = frame.display;
        held.stale = {};
        if (!stay_) {
            const Commands::Region all{0, glm::uvec3(0), glm::uvec3(size_px, 1)};
            bytes.push_back(commands.read_back(*held.image, std::span(&all, 1),
                                               uint64_t{4} * size_px.x * size_px.y));
        }
        pictures.push_back({.panel = frame.panel, .size_px = size_px, .image = held.image});
    }
    const uint64_t value = commands.submit();
    commands.ticket().wait();
    for (size_t i = 0; i < pictures.size(); ++i) {
        Picture& picture = pictures[i];
        if (stay_) {
            picture.ready = device_->done_by(value);
            continue;
        }
        const std::span<const std::byte> mapped = bytes[i].mapped();
        picture.rgba.assign(mapped.begin(), mapped.end());
        picture.image.reset();
    }
    return pictures;
}

} // namespace palpate::view
