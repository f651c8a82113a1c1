#include "engine/segment/fuzzy_connectedness.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "engine/segment/flood.h"
#include "engine/segment/map_values.h"

namespace palpate {

namespace {

// Strengths from 1 down to 0 as heights from 0 up, exactly and back: floats of one sign are in the
// order of their bits.
constexpr uint32_t kOne = 0x3f800000;
float height_of(float strength) {
    return std::bit_cast<float>(kOne - std::bit_cast<uint32_t>(strength));
}
float strength_of(float height) {
    return std::bit_cast<float>(kOne - std::bit_cast<uint32_t>(height));
}

} // namespace

Result<Volume> fuzzy_connectedness(const Volume& volume, const Volume& seeds, uint16_t label,
                                   const Affinity& affinity, const Task& task) {
    const float same = float(1.0 / (std::sqrt(2.0) * affinity.homogeneity));
    const float object = float(1.0 / (std::sqrt(2.0) * affinity.sd));
    const float mean = float(affinity.mean), weight = float(affinity.weight);
    const auto pass = [&](float a, float b) {
        const float d = (a - b) * same, o = (0.5f * (a + b) - mean) * object;
        const float strength = weight * std::exp(-d * d) + (1.0f - weight) * std::exp(-o * o);
        return height_of(std::clamp(strength, 0.0f, 1.0f));
    };
    PALPATE_TRY(const Volume heights,
                lowest_paths(volume, seeds, label, pass, height_of(0.0f), task.part(0.0, 0.95)));
    return map_values<float>(
        std::array{&heights}, task.part(0.95, 1.0),
        [](std::array<float, 1> h) { return std::isnan(h[0]) ? h[0] : strength_of(h[0]); });
}

} // namespace palpate
