#include "engine/volume/compare.h"

#include <algorithm>
#include <cmath>

#include "engine/base/assert.h"

namespace palpate {

namespace {

Result<void> check_sizes(glm::uvec3 a, glm::uvec3 b) {
    if (a != b)
        return fail("the volumes differ in size: {} x {} x {} and {} x {} x {} voxels", a.x, a.y,
                    a.z, b.x, b.y, b.z);
    return {};
}

// Calls visit(first, second) with the values of every voxel, x fastest. Sizes are equal.
template <class Visit>
void for_each_pair(const Volume& first, const Volume& second, Visit&& visit) {
    const glm::uvec3 size = first.size();
    std::vector<float> a(size.x), b(size.x);
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y) {
            read_row(first, {0, y, z}, size.x, a.data());
            read_row(second, {0, y, z}, size.x, b.data());
            for (uint32_t x = 0; x < size.x; ++x)
                visit(a[x], b[x]);
        }
}

double corner_distance_mm(const Grid& a, const Grid& b) {
    double farthest = 0.0;
    for (uint32_t corner = 0; corner < 8; ++corner) {
        const glm::dvec3 index =
            glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2) * glm::dvec3(a.size - 1u);
        farthest = std::max(farthest, glm::distance(world_point(a, index), world_point(b, index)));
    }
    return farthest;
}

} // namespace

Result<VolumeDifference> compare_volumes(const Volume& first, const Volume& second, double bound) {
    PALPATE_ASSERT_CMP(bound, >=, 0.0);
    PALPATE_TRY(check_sizes(first.size(), second.size()));
    VolumeDifference out;
    out.geometry_mm = corner_distance_mm(first.grid(), second.grid());
    out.same_type = first.type() == second.type();
    double sum = 0.0, squares = 0.0;
    uint64_t measured = 0;
    for_each_pair(first, second, [&](float a, float b) {
        if (std::isnan(a) || std::isnan(b)) {
            out.nan_mismatch += std::isnan(a) != std::isnan(b);
            return;
        }
        const double difference = double{b} - double{a};
        ++measured;
        sum += difference;
        squares += difference * difference;
        out.max_abs = std::max(out.max_abs, std::abs(difference));
        out.differing += std::abs(difference) > bound;
    });
    out.differing += out.nan_mismatch;
    if (measured > 0) {
        out.rmse = std::sqrt(squares / static_cast<double>(measured));
        out.mean_signed = sum / static_cast<double>(measured);
    }
    return out;
}

Result<std::vector<LabelAgreement>> compare_labels(const Volume& first, const Volume& second) {
    PALPATE_TRY(check_sizes(first.size(), second.size()));
    std::vector<LabelAgreement> labels(65536);
    for_each_pair(first, second, [&](float a, float b) {
        PALPATE_ASSERT(a >= 0.0f && a <= 65535.0f && b >= 0.0f && b <= 65535.0f);
        ++labels[static_cast<size_t>(a)].first;
        ++labels[static_cast<size_t>(b)].second;
        if (a == b)
            ++labels[static_cast<size_t>(a)].both;
    });
    std::vector<LabelAgreement> out;
    for (uint32_t label = 1; label < labels.size(); ++label)
        if (labels[label].first + labels[label].second > 0) {
            labels[label].label = label;
            out.push_back(labels[label]);
        }
    return out;
}

} // namespace palpate
