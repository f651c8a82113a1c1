#include "engine/measure/label_statistics.h"

#include <cmath>
#include <map>
#include <utility>

#include "engine/measure/histogram.h"
#include "engine/volume/sample.h"

namespace palpate {

namespace {

constexpr double kSamePlace = 1e-3; // of a sample

// Whether the same index is at the same place in both.
bool lie_alike(const Grid& a, const Grid& b) {
    if (a.size != b.size)
        return false;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 index =
            glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2) * (glm::dvec3(a.size) - 1.0);
        const glm::dvec3 off = glm::abs(index_point(b, world_point(a, index)) - index);
        if (!(off.x <= kSamePlace && off.y <= kSamePlace && off.z <= kSamePlace))
            return false;
    }
    return true;
}

struct LabelFound {
    LabelStatistics figures;
    // Sums over indices less the first sample's: whole numbers, exact in double.
    glm::dvec3 first{0.0}, sum{0.0};
    glm::dmat3 products{0.0};
    std::vector<float> values;
};

std::vector<uint64_t> histogram_of(const std::vector<float>& values, ValueRange range,
                                   size_t bins) {
    if (bins == 0 || range.empty())
        return {};
    const double low = double{range.min}, width = double{range.max} - low;
    Histogram counts(low, width > 0.0 ? double{range.max} : low + 1.0, bins);
    std::vector<uint64_t> out(bins, 0);
    for (const float v : values)
        if (!std::isnan(v))
            ++out[counts.bin_of(double{v})];
    return out;
}

} // namespace

double sample_mm3(const Grid& grid) {
    return std::abs(glm::determinant(glm::dmat3(grid.world_from_index)));
}

std::optional<std::vector<LabelStatistics>> label_statistics(const Volume& labels,
                                                             const Volume* grey,
                                                             const std::stop_token& stop,
                                                             size_t bins) {
    const Grid& grid = labels.grid();
    const bool alike = grey && lie_alike(grid, grey->grid());
    std::optional<SampleCursor> cursor;
    if (grey && !alike)
        cursor.emplace(*grey);
    std::map<uint32_t, LabelFound> found;
    std::vector<float> row(grid.size.x), values(grid.size.x);
    for (uint32_t z = 0; z < grid.size.z; ++z)
        for (uint32_t y = 0; y < grid.size.y; ++y) {
            if (stop.stop_requested())
                return std::nullopt;
            read_row(labels, {0, y, z}, grid.size.x, row.data());
            bool has_values = false;
            LabelFound* last = nullptr;
            for (uint32_t x = 0; x < grid.size.x; ++x) {
                const auto label = row[x] > 0.0f ? static_cast<uint32_t>(row[x]) : 0u;
                if (label == 0)
                    continue;
                const glm::uvec3 at(x, y, z);
                if (!last || last->figures.label != label) {
                    last = &found.try_emplace(label).first->second;
                    if (last->figures.count == 0) {
                        last->figures = {.label = label, .low = at, .high = at};
                        last->first = glm::dvec3(at);
                    }
                }
                LabelStatistics& figures = last->figures;
                ++figures.count;
                figures.low = glm::min(figures.low, at);
                figures.high = glm::max(figures.high, at);
                const glm::dvec3 from_first = glm::dvec3(at) - last->first;
                last->sum += from_first;
                last->products += glm::outerProduct(from_first, from_first);
                if (alike && !std::exchange(has_values, true))
                    read_row(*grey, {0, y, z}, grid.size.x, values.data());
                if (alike)
                    last->values.push_back(values[x]);
                else if (grey)
                    last->values.push_back(static_cast<float>(cursor->value(
                        index_point(grey->grid(), world_point(grid, glm::dvec3(at))))));
            }
        }
    std::vector<LabelStatistics> all;
    for (auto& [label, one] : found) {
        const auto count = static_cast<double>(one.figures.count);
        one.figures.volume_mm3 = count * sample_mm3(grid);
        const glm::dvec3 mean = one.sum / count;
        one.figures.centroid_mm = world_point(grid, one.first + mean);
        // A box of a sample adds a twelfth of its squared side.
        const glm::dmat3 moments =
            one.products / count - glm::outerProduct(mean, mean) + glm::dmat3(1.0 / 12.0);
        const glm::dmat3 axes(grid.world_from_index);
        one.figures.covariance_mm2 = axes * moments * glm::transpose(axes);
        if (grey)
            one.figures.histogram = histogram_of(one.values, grey->range(), bins);
        one.figures.values = statistics_of(std::move(one.values));
        all.push_back(one.figures);
    }
    return all;
}

} // namespace palpate
