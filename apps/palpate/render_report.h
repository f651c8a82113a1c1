#pragma once

#include "apps/palpate/render_timing.h"
#include "engine/base/json.h"

namespace palpate {

// The report of --stats: times, passes, resources, samples, and an error estimate, for which the
// renderer draws other pictures: read its last one back before.
Json stats_json(const GpuDevice& device, Renderer& renderer, const Timing& timing,
                const Scene& scene, const SceneData& data);

} // namespace palpate
