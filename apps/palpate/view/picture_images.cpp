#include "apps/palpate/view/picture_images.h"

#include "engine/base/profile.h"

namespace palpate::view {

std::shared_ptr<GpuImage> PictureImages::image_for(Panel panel, glm::uvec2 size_px) {
    auto& images = images_[static_cast<size_t>(panel)];
    std::erase_if(images, [&](const std::shared_ptr<GpuImage>& image) {
        return image.use_count() == 1 && glm::uvec2(image->shape().size) != size_px;
    });
    for (const std::shared_ptr<GpuImage>& image : images)
        if (image.use_count() == 1)
            return image;
    return images.emplace_back(std::make_shared<GpuImage>(
        DisplayPass::make_target(*device_, std::string("picture of ") + name_of(panel), size_px)));
}

std::vector<Picture> PictureImages::finish(Commands& commands, std::span<const Frame> frames) {
    const profile::Scope scope("display");
    std::vector<Picture> pictures;
    std::vector<BufferSlice> bytes;
    for (const Frame& frame : frames) {
        const glm::uvec2 size_px =
            display_size_px(glm::uvec2(frame.eyes->shape().size), frame.display.layout);
        std::shared_ptr<GpuImage> image = image_for(frame.panel, size_px);
        pass_.record(commands, *frame.eyes, frame.display, {.image = *image});
        if (!stay_) {
            const Commands::Region all{0, glm::uvec3(0), glm::uvec3(size_px, 1)};
            bytes.push_back(commands.read_back(*image, std::span(&all, 1),
                                               uint64_t{4} * size_px.x * size_px.y));
        }
        pictures.push_back({.panel = frame.panel, .size_px = size_px, .image = std::move(image)});
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
