#include "engine/scene/scene.h"

#include <algorithm>
#include <cmath>

#include "engine/volume/extent.h"

namespace palpate {

glm::dvec3 towards(const Light& light, const Camera& camera) {
    const View view = make_view(camera, {1, 1});
    const double azimuth = glm::radians(light.azimuth_deg);
    const double elevation = glm::radians(light.elevation_deg);
    return std::cos(elevation) *
               (std::sin(azimuth) * view.right - std::cos(azimuth) * view.forward) +
           std::sin(elevation) * view.up;
}

LabelStyle style_of(const LabelLayer& layer, uint32_t label) {
    if (label < layer.styles.size())
        return layer.styles[label];
    // Hues a golden-ratio apart are far from each other for any run of labels.
    const double hue = 6.0 * std::fmod(0.61803398874989485 * label, 1.0);
    const double value = label / 7 % 2 == 0 ? 1.0 : 0.75;
    const double saturation = label / 3 % 2 == 0 ? 0.85 : 0.6;
    const auto channel = [&](double offset) {
        const double k = std::fmod(offset + hue, 6.0);
        return value - value * saturation * std::clamp(std::min(k, 4.0 - k), 0.0, 1.0);
    };
    return {.color = {channel(5.0), channel(3.0), channel(1.0)}};
}

SurfaceStyle style_of(const SurfaceLayer& layer, const LabelLayer& labels, uint32_t label) {
    const LabelStyle style = style_of(labels, label);
    return {style.color, style.visible ? style.opacity * layer.style.opacity : 0.0};
}

SurfaceStyle style_of(const SurfaceLayer& layer, uint32_t label) {
    if (label == 0)
        return layer.style;
    if (label < layer.label_styles.size())
        return layer.label_styles[label];
    return {style_of(LabelLayer{}, label).color, layer.style.opacity};
}

double jitter_share(uint32_t seed, glm::uvec2 pixel, uint32_t eye) {
    uint32_t h =
        seed * 0x27d4eb2fu ^ pixel.x * 0x9e3779b1u ^ pixel.y * 0x85ebca77u ^ eye * 0xc2b2ae3du;
    for (int i = 0; i < 2; ++i) { // the finaliser of MurmurHash3, twice: neighbours are far apart
        h = (h ^ h >> 16) * 0x85ebca6bu;
        h = (h ^ h >> 13) * 0xc2b2ae35u;
        h ^= h >> 16;
    }
    return (h >> 8) * 0x1p-24;
}

double step_mm_of(const RayCastLayer& layer, const Grid& grid) {
    return layer.step_mm > 0.0 ? layer.step_mm : smallest_spacing_mm(grid);
}

Result<void> check_steps(const RayCastLayer& layer, const Grid& grid) {
    constexpr double kMostSteps = 60000.0;
    if (layer.integrator == Integrator::exact) // goes from cell to cell
        return {};
    double longest_mm = 0.0; // diagonal of the volume
    const glm::dvec3 last = glm::dvec3(grid.size) - 1.0;
    for (const glm::dvec3 sign : {glm::dvec3(1, 1, 1), {-1, 1, 1}, {1, -1, 1}, {1, 1, -1}})
        longest_mm =
            std::max(longest_mm, glm::length(glm::dmat3(grid.world_from_index) * (sign * last)));
    const double step_mm = step_mm_of(layer, grid);
    if (longest_mm <= kMostSteps * step_mm)
        return {};
    return fail(
        "a step of {:g} mm: expected at least {:g} mm, {:.0f} steps along the volume's diagonal of "
        "{:g} mm, or the integrator exact",
        step_mm, longest_mm / kMostSteps, kMostSteps, longest_mm);
}

} // namespace palpate
