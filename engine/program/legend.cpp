// The legend of a figure: which labels its picture shows.

#include <algorithm>
#include <cmath>
#include <map>

#include "engine/program/figure_options.h"
#include "engine/program/surface_labels.h"

namespace palpate {

namespace {

// How often each label lies at the nearest slice behind a pixel; in stereo of the middle eye.
std::map<uint32_t, uint64_t> labels_of_slices(const Scene& scene, const Volume& labels) {
    std::map<uint32_t, uint64_t> found;
    const View view = make_view(scene.camera, scene.size_px);
    const glm::dvec3 last(labels.size() - 1u);
    for (uint32_t y = 0; y < scene.size_px.y; ++y)
        for (uint32_t x = 0; x < scene.size_px.x; ++x) {
            const Ray ray = ray_through(view, {x, y}, scene.size_px);
            double nearest = INFINITY;
            glm::dvec3 index(0.0);
            for (const SliceLayer& slice : scene.slices) {
                const double along = glm::dot(slice.normal, ray.direction);
                const double t = glm::dot(slice.normal, slice.point_mm - ray.origin_mm) / along;
                if (!(t > 0.0 && t < nearest)) // a plane along the ray has no t
                    continue;
                const glm::dvec3 at =
                    glm::round(index_point(labels.grid(), ray.origin_mm + t * ray.direction));
                if (glm::all(glm::greaterThanEqual(at, glm::dvec3(0.0))) &&
                    glm::all(glm::lessThanEqual(at, last))) {
                    nearest = t;
                    index = at;
                }
            }
            if (std::isfinite(nearest))
                ++found[static_cast<uint32_t>(labels.value(glm::uvec3(index)))];
        }
    return found;
}

} // namespace

std::vector<LegendEntry> legend_of(const Scene& scene, const LoadedScene& loaded) {
    return loaded.data.labels ? legend_of(scene, *loaded.data.labels, loaded.label_names)
                              : std::vector<LegendEntry>();
}

std::vector<LegendEntry> legend_of(const Scene& scene, const Volume& labels,
                                   std::span<const LabelName> names) {
    if (!scene.labels)
        return {};
    const bool flat = !scene.slices.empty() && !scene.ray_cast && scene.surfaces.empty();
    std::map<uint32_t, uint64_t> found;
    if (flat)
        found = labels_of_slices(scene, labels);
    else
        for (const auto& [label, count] : count_labels(labels))
            found[label] = count;
    std::vector<std::pair<uint64_t, uint32_t>> by_count;
    for (const auto& [label, count] : found)
        if (label > 0 && style_of(*scene.labels, label).visible)
            by_count.emplace_back(count, label);
    std::sort(by_count.begin(), by_count.end(), [](const auto& a, const auto& b) {
        return a.first != b.first ? a.first > b.first : a.second < b.second;
    });
    std::vector<LegendEntry> legend;
    for (const auto& [count, label] : by_count) {
        const auto named =
            std::find_if(names.begin(), names.end(),
                         [label = label](const LabelName& l) { return l.label == label; });
        const bool has_name = named != names.end() && !named->name.empty();
        legend.push_back({has_name ? named->name : fmt::format("label {}", label),
                          style_of(*scene.labels, label).color});
    }
    return legend;
}

} // namespace palpate
