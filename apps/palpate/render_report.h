#pragma once

#include <nlohmann/json.hpp>

#include "apps/palpate/render_timing.h"

namespace palpate {

// What the device's sampler adds to an error, as a share of the contrast.
double weight_error(const Device& device);

// What --stats writes: times, passes, resources, samples, and an estimate of the error.
nlohmann::ordered_json stats_json(const Device& device, const Renderer& renderer,
                                  const Timing& timing, const Scene& scene, const SceneData& data);

} // namespace palpate
