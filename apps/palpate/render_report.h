#pragma once

#include "engine/base/json.h"
#include "engine/program/render_timing.h"

namespace palpate {

// The report of --stats: times, passes, resources, samples, and an error estimate, for which the
// renderer draws other pictures: read its last one back before.
Json stats_json(const GpuDevice& device, Renderer& renderer, const Timing& timing,
                const Scene& scene, const SceneData& data);

} // namespace palpate
