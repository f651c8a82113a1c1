#include "apps/palpate/render_report.h"

#include <algorithm>

#include "apps/palpate/preview.h"
#include "engine/accuracy/accuracy.h"
#include "engine/base/percentile.h"
#include "engine/base/profile.h"

namespace palpate {

namespace {

// RMSE of colour beside an exact picture of the field, measured; slices have none. Fewer rays add
// their own. Null where it cannot be measured. The renderer's last picture is another one then.
Json error_estimate(Renderer& renderer, const Timing& timing, const Scene& scene,
                    const SceneData& data) {
    if (!scene.ray_cast)
        return 0.0;
    const profile::Scope scope("error estimate");
    Result<AccuracyJudge> judge = AccuracyJudge::make(renderer, scene, data);
    if (!judge)
        return nullptr;
    const Result<double> estimate = judge->estimate(*scene.ray_cast);
    if (!estimate)
        return nullptr;
    return *estimate + (timing.interactive ? timing.interactive->error_estimate : 0.0);
}

} // namespace

Json stats_json(const GpuDevice& device, Renderer& renderer, const Timing& timing,
                const Scene& scene, const SceneData& data) {
    Json json;
    json["device"] = device.info().name;
    json["driver"] = device.info().driver;
    json["first_frame_ms"] = timing.first_frame_ms;
    json["pipeline_creation_ms"] = renderer.pipeline_creation_ms();
    json["frame_ms"] = {{"median", percentile(timing.wall_ms, 0.5)},
                        {"p95", percentile(timing.wall_ms, 0.95)},
                        {"gpu_median", percentile(timing.gpu_ms, 0.5)},
                        {"frames", timing.wall_ms.size()}};
    json["clocks"] = {{"gpu_ms", percentile(timing.gpu_ms, 0.5)},
                      {"fenced_wall_ms", percentile(timing.wall_ms, 0.5)},
                      {"disagreement", timing.disagreement()},
                      {"agree", timing.disagreement() <= kClocksMayDiffer}};
    const GpuDevice::Traffic& traffic = device.traffic();
    json["bytes_moved"] = {{"to_device", traffic.uploaded_bytes},
                           {"uploads", traffic.uploads},
                           {"from_device", traffic.read_back_bytes},
                           {"read_backs", traffic.read_backs}};
    json["passes"] = Json::array();
    for (const PassTime& pass : timing.passes)
        json["passes"].push_back({{"name", pass.name}, {"gpu_ms", pass.gpu_ms}});
    json["resources"] = Json::array();
    for (const ResourceInfo& resource : device.resources())
        json["resources"].push_back(
            {{"name", resource.name}, {"kind", resource.kind}, {"bytes", resource.bytes}});
    if (scene.ray_cast && timing.interactive) {
        json["interactive"] = {{"budget_ms", timing.budget_ms},
                               {"budget_met", percentile(timing.wall_ms, 0.5) <= timing.budget_ms},
                               {"step_factor", timing.interactive->step_factor},
                               {"traced_share", timing.interactive->traced_share},
                               {"px_per_ray", timing.interactive->px_per_ray},
                               {"error_estimate", timing.interactive->error_estimate},
                               {"complete", timing.interactive->complete}};
    } else if (scene.ray_cast) {
        json["samples"] = timing.samples;
        // `exact` takes pieces of cells, of which no lattice tells how many there would be.
        json["segments"] = nullptr;
        json["skipped_share"] = nullptr;
        if (scene.ray_cast->integrator != Integrator::exact) {
            const auto segments = static_cast<double>(count_segments(scene, data.volume.grid()));
            json["segments"] = segments;
            json["skipped_share"] =
                std::max(0.0, 1.0 - static_cast<double>(timing.samples) / std::max(1.0, segments));
        }
        json["opacity_unit_mm"] = scene.ray_cast->transfer.opacity_unit_mm;
        json["cell_map_ms"] = timing.cell_map_ms;
        if (timing.first.gradients_ms > 0)
            json["gradients_ms"] = timing.first.gradients_ms;
    }
    if (!scene.surfaces.empty()) {
        json["surfaces"] = Json::array();
        for (const auto& mesh : data.meshes)
            json["surfaces"].push_back(mesh ? Json{{"triangles", mesh->triangles.size()},
                                                   {"vertices", mesh->positions.size()}}
                                            : Json{{"live", true}});
        json["exact_see_through_layers"] = scene.surface_depth;
    }
    json["residency"] = residency_json(timing.first);
    json["peak_rss_bytes"] = peak_rss_bytes();
    json["error_estimate"] = error_estimate(renderer, timing, scene, data);
    json["volume_version"] = data.volume.version();
    return json;
}

} // namespace palpate
