#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"

namespace palpate {

// A picture of floats: row 0 is the top row, samples of a pixel lie side by side.
//
// Colours are display values: 0 is black, 1 is white, and an 8-bit file stores
// round(255 * clamp(v, 0, 1)). Other channels may hold anything (HU, mm); NaN means "nothing here".
struct Image {
    glm::uvec2 size_px{};
    std::vector<std::string>
        channels;               // names as in an EXR file: "R", "G", "B", "A", "value", "depth"
    std::vector<float> samples; // size_px.x * size_px.y * channels.size()

    float& at(uint32_t x, uint32_t y, size_t channel) {
        return samples[(size_t{y} * size_px.x + x) * channels.size() + channel];
    }
    float at(uint32_t x, uint32_t y, size_t channel) const {
        return samples[(size_t{y} * size_px.x + x) * channels.size() + channel];
    }
};

// An image of zeros.
Image make_image(glm::uvec2 size_px, std::vector<std::string> channels);

// The position within a pixel of the channel of this name, if there is one.
std::optional<size_t> channel_index(const Image& image, std::string_view name);

// Limits of a picture read from a file: 2^16 pixels on a side, 64 channels, and 1 GiB of samples in
// all. Readers refuse more before they allocate.
constexpr uint64_t kMaxImageSide = 65536;
constexpr uint64_t kMaxImageChannels = 64;
constexpr uint64_t kMaxImageBytes = uint64_t{1} << 30;
Result<void> check_image_limits(const std::filesystem::path& path, uint64_t width, uint64_t height,
                                uint64_t channels);

} // namespace palpate
