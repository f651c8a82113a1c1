#pragma once

#include <nlohmann/json.hpp>

#include "apps/palpate/render_timing.h"

namespace palpate {

// What --stats writes: times, passes, resources, samples, and an estimate of the error, for which
// the renderer draws other pictures: read its last one back before.
nlohmann::ordered_json stats_json(const GpuDevice& device, Renderer& renderer, const Timing& timing,
                                  const Scene& scene, const SceneData& data);

} // namespace palpate
