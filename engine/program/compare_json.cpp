#include "engine/program/compare_json.h"

#include "engine/mesh/topology.h"
#include "engine/program/compare_labels.h"

namespace palpate {

namespace {

Json json_of(const SurfaceDistance& distance) {
    return {{"largest_mm", distance.largest_mm},
            {"mean_mm", distance.mean_mm},
            {"rms_mm", distance.rms_mm},
            {"normal_rms_deg", distance.normal_rms_deg},
            {"normal_max_deg", distance.normal_max_deg}};
}

// The length of the box round a mesh, in world mm; 1 for one point or none.
double extent_mm(const Mesh& mesh) {
    if (mesh.positions.empty())
        return 1.0;
    const glm::dmat3 linear(mesh.world_from_mesh);
    glm::dvec3 low(linear * glm::dvec3(mesh.positions[0])), high = low;
    for (const glm::vec3 p : mesh.positions) {
        low = glm::min(low, linear * glm::dvec3(p));
        high = glm::max(high, linear * glm::dvec3(p));
    }
    const double extent = glm::length(high - low);
    return extent > 0.0 ? extent : 1.0;
}

} // namespace

Json json_of(const SampleDifference& difference) {
    return {{"max", difference.max_abs},
            {"rmse", difference.rmse},
            {"mean_signed", difference.mean_signed},
            {"share_beyond", difference.share_beyond},
            {"beyond", difference.beyond},
            {"nan_mismatch", difference.nan_mismatch}};
}

Json json_of(const ImageDifference& difference) {
    Json json = json_of(difference.all);
    if (difference.rgb)
        json["rgb"] = json_of(*difference.rgb);
    for (const SampleDifference& channel : difference.channels)
        json["channels"][channel.channel] = json_of(channel);
    json["neighborhood_match_share"] = difference.neighborhood_match_share;
    json["flip_mean"] = difference.flip_mean ? Json(*difference.flip_mean) : Json();
    return json;
}

SampleDifference samples_of(const VolumeDifference& difference, uint64_t count) {
    return {.channel = "all",
            .max_abs = difference.max_abs,
            .rmse = difference.rmse,
            .mean_signed = difference.mean_signed,
            .share_beyond = static_cast<double>(difference.differing) / static_cast<double>(count),
            .beyond = difference.differing,
            .nan_mismatch = difference.nan_mismatch};
}

double distance_tolerance_mm(const Mesh& mesh) {
    return 1e-4 * extent_mm(mesh);
}

Json mesh_json(const Mesh& first, const Mesh& second, const MeshDistance& distance,
               HausdorffRange hausdorff) {
    const MeshTopology a = topology(first), b = topology(second);
    Json json{{"kind", "mesh"},
              {"triangles", {a.triangles, b.triangles}},
              {"vertices", {a.vertices, b.vertices}},
              {"components", {a.components.size(), b.components.size()}},
              {"euler_number", {a.euler_number, b.euler_number}},
              {"open_edges", {a.open_edges, b.open_edges}},
              {"area_mm2", {a.area_mm2, b.area_mm2}},
              {"hausdorff_mm", hausdorff.least},
              {"hausdorff_most_mm", hausdorff.most},
              {"hausdorff_tolerance_mm", hausdorff.most - hausdorff.least},
              {"rms_mm", distance.rms_mm()},
              {"normal_rms_deg",
               std::max(distance.forward.normal_rms_deg, distance.backward.normal_rms_deg)},
              {"forward", json_of(distance.forward)},
              {"backward", json_of(distance.backward)}};
    json.update(enclosed_volumes(first, a, second, b));
    return json;
}

} // namespace palpate
