#include "engine/image/image.h"

#include <algorithm>

namespace palpate {

Image make_image(glm::uvec2 size_px, std::vector<std::string> channels) {
    Image image;
    image.size_px = size_px;
    image.channels = std::move(channels);
    image.samples.resize(size_t{size_px.x} * size_px.y * image.channels.size());
    return image;
}

std::optional<size_t> channel_index(const Image& image, std::string_view name) {
    const auto found = std::find(image.channels.begin(), image.channels.end(), name);
    if (found == image.channels.end())
        return std::nullopt;
    return static_cast<size_t>(found - image.channels.begin());
}

Result<void> check_image_limits(const std::filesystem::path& path, uint64_t width, uint64_t height,
                                uint64_t channels) {
    if (width == 0 || height == 0 || width > kMaxImageSide || height > kMaxImageSide)
        return fail("{}: expected a picture of 1 to {} pixels a side, found {} x {}", path.string(),
                    kMaxImageSide, width, height);
    if (channels == 0 || channels > kMaxImageChannels)
        return fail("{}: expected 1 to {} channels, found {}", path.string(), kMaxImageChannels,
                    channels);
    const uint64_t bytes = width * height * channels * sizeof(float);
    if (bytes > kMaxImageBytes)
        return fail("{}: expected a picture of at most {} bytes, found {} x {} of {} channels: {}",
                    path.string(), kMaxImageBytes, width, height, channels, bytes);
    return {};
}

} // namespace palpate
