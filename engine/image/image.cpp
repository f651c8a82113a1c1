#include "engine/image/image.h"

namespace palpate {

Image make_image(glm::uvec2 size_px, std::vector<std::string> channels) {
    Image image;
    image.size_px = size_px;
    image.channels = std::move(channels);
    image.samples.resize(size_t{size_px.x} * size_px.y * image.channels.size());
    return image;
}

} // namespace palpate
