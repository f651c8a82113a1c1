#include "apps/view/document/label_import.h"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "engine/segment/resample.h"
#include "engine/segment/seeds.h"
#include "engine/volume/builder.h"
#include "engine/volume/extent.h"

namespace palpate::view {

namespace {

// The places of a grid's corner samples, by the index of another; each within 2 % of a sample of
// one of that grid's corners, or none.
std::vector<glm::ivec3> corners_in(const Grid& grid, const Grid& other) {
    constexpr double kNear = 0.02; // of a sample
    std::vector<glm::ivec3> corners;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 at =
            glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2) * (glm::dvec3(grid.size) - 1.0);
        const glm::dvec3 index = index_point(other, world_point(grid, at));
        const glm::dvec3 nearest = glm::round(index), last = glm::dvec3(other.size) - 1.0;
        for (int axis = 0; axis < 3; ++axis)
            if (std::abs(index[axis] - nearest[axis]) > kNear ||
                (nearest[axis] != 0.0 && nearest[axis] != last[axis]))
                return {};
        corners.emplace_back(nearest);
    }
    return corners;
}

double labelled_mm3(const Volume& labels) {
    double samples = 0.0;
    for (const LabelCount& one : label_counts(labels))
        samples += static_cast<double>(one.count);
    return samples * std::abs(glm::determinant(glm::dmat3(labels.grid().world_from_index)));
}

} // namespace

bool have_same_samples(const Grid& a, const Grid& b) {
    const std::vector<glm::ivec3> corners = corners_in(a, b);
    if (corners.empty() || sample_count(a) != sample_count(b))
        return false;
    for (int axis = 0; axis < 3; ++axis) { // as many samples along each edge
        const glm::ivec3 edge = glm::abs(corners[1 << axis] - corners[0]);
        if (edge.x + edge.y + edge.z != static_cast<int>(a.size[axis]) - 1)
            return false;
    }
    return true;
}

Result<LoadedVolume> on_grid(LoadedVolume labels, const Grid& grid, const std::stop_token& stop) {
    const Grid own = labels.volume.grid();
    if (own == grid)
        return labels;
    if (const std::string apart = apart_text("the label map", own, grid); !apart.empty())
        return fail("{}", apart);
    const bool is_same = have_same_samples(own, grid);
    if (is_same && corners_in(own, grid) == corners_in(grid, grid)) {
        labels.volume = with_grid(labels.volume, grid);
        return labels;
    }
    const double before_mm3 = labelled_mm3(labels.volume);
    PALPATE_TRY(labels.volume, resample(labels.volume, {grid, ResampledBy::nearest}, {stop, {}}));
    if (!is_same)
        labels.notes.push_back(
            fmt::format("the label map has other samples ({} x {} x {}): each sample of the volume "
                        "takes the label of the nearest one, and 0 outside the map",
                        own.size.x, own.size.y, own.size.z));
    const double kept = labelled_mm3(labels.volume) / before_mm3;
    constexpr double kMostOutside = 0.1; // by which other samples may differ
    if (kept < 1.0 - kMostOutside)
        labels.notes.push_back(
            fmt::format("{:.0f} % of the labels lie outside the volume and are left out",
                        100.0 * (1.0 - kept)));
    return labels;
}

} // namespace palpate::view
