#include "engine/program/surface_labels.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

#include "engine/base/option_name.h"
#include "engine/mesh/label_surfaces.h"
#include "engine/surface/surface_nets.h"
#include "engine/volume/builder.h"

namespace palpate {

std::map<uint16_t, uint64_t> count_labels(const Volume& volume) {
    std::map<uint16_t, uint64_t> voxels;
    std::vector<float> row(volume.size().x);
    for (uint32_t z = 0; z < volume.size().z; ++z)
        for (uint32_t y = 0; y < volume.size().y; ++y) {
            read_row(volume, {0, y, z}, volume.size().x, row.data());
            for (const float value : row)
                ++voxels[static_cast<uint16_t>(value)];
        }
    return voxels;
}

Result<std::vector<uint16_t>> labels_named(std::span<const std::string> texts,
                                           std::span<const LabelName> names) {
    std::vector<uint16_t> labels;
    for (const std::string& text : texts) {
        const auto named = std::find_if(names.begin(), names.end(),
                                        [&](const LabelName& known) { return known.name == text; });
        uint16_t number = 0;
        const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number);
        const bool is_number = error == std::errc() && rest == text.data() + text.size();
        if (named == names.end() && !is_number) {
            std::vector<std::string> known;
            for (const LabelName& name : names)
                known.push_back(name.name);
            return fail("expected {}, found '{}'",
                        known.empty()
                            ? "a number, because the label map names no labels"
                            : fmt::format("a number or one of {}", fmt::join(known, ", ")),
                        text);
        }
        labels.push_back(named != names.end() ? static_cast<uint16_t>(named->label) : number);
    }
    return labels;
}

Result<Volume> with_labels(const Volume& volume, std::span<const uint16_t> labels) {
    const std::map<uint16_t, uint64_t> voxels = count_labels(volume);
    for (const uint16_t label : labels)
        if (!voxels.contains(label))
            return fail("{}: no sample has label {}; the largest label is {}", Option{"labels"},
                        label, voxels.rbegin()->first);
    return make_volume(volume.grid(), volume.type(), [&](glm::uvec3 at) {
        const double label = volume.value(at);
        return std::find(labels.begin(), labels.end(), label) != labels.end() ? label : 0.0;
    });
}

Json json_of(const MeshTopology& found) {
    return {{"triangles", found.triangles},
            {"vertices", found.vertices},
            {"components", found.components.size()},
            {"euler_number", found.euler_number},
            {"open_edges", found.open_edges},
            {"non_manifold_edges", found.non_manifold_edges},
            {"non_manifold_vertices", found.non_manifold_vertices},
            {"misoriented_edges", found.misoriented_edges},
            {"duplicate_triangles", found.duplicate_triangles},
            {"zero_area_triangles", found.zero_area_triangles},
            {"area_mm2", found.area_mm2},
            {"volume_mm3", found.volume_mm3}};
}

Json label_entries(const Mesh& mesh, const Volume& volume, std::optional<uint32_t> exact_passes) {
    const std::map<uint16_t, uint64_t> voxels = count_labels(volume);
    std::map<uint16_t, double> twin;
    if (exact_passes)
        for (const LabelVolume& label :
             surface_nets_volumes_fp64(volume, {.passes = *exact_passes}))
            twin[label.label] = label.volume_mm3;
    const double voxel_mm3 = std::abs(glm::determinant(glm::dmat3(volume.grid().world_from_index)));
    std::map<uint16_t, Json> found;
    for_each_label(mesh, [&](uint16_t label, const Mesh& surface) {
        if (label != 0)
            found[label] = json_of(topology(surface));
    });
    Json entries = Json::array();
    for (const auto& [label, count] : voxels) {
        if (label == 0)
            continue;
        Json entry{{"label", label}};
        const auto at = found.find(label);
        entry.update(at != found.end() ? at->second : json_of(MeshTopology())); // all were dropped
        entry["voxels"] = count;
        entry["voxels_mm3"] = voxel_mm3 * static_cast<double>(count);
        if (const auto exact = twin.find(label); exact != twin.end())
            entry["volume_fp64_mm3"] = exact->second;
        entries.push_back(std::move(entry));
    }
    return entries;
}

void count_faults_by_label(Json& report, const Json& labels) {
    report["line_edges"] = report["non_manifold_edges"];
    for (const char* fault : {"open_edges", "non_manifold_edges", "non_manifold_vertices",
                              "misoriented_edges", "duplicate_triangles", "zero_area_triangles"}) {
        double sum = 0;
        for (const Json& label : labels)
            sum += label[fault].number;
        report[fault] = sum;
    }
}

} // namespace palpate
