#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

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

} // namespace palpate
