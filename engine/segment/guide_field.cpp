#include "engine/segment/guide_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "engine/segment/gaussian.h"
#include "engine/segment/grid_change.h"
#include "engine/segment/map_values.h"
#include "engine/segment/resample.h"
#include "engine/segment/signed_distance.h"
#include "engine/volume/box.h"
#include "engine/volume/builder.h"
#include "engine/volume/extent.h"
#include "engine/volume/grid.h"

namespace palpate {

namespace {

// Beside its surface signed_distance() goes from -h to h over h: half the smallest spacing less on
// both sides, it rises as a distance does.
Result<Volume> distance_to(const Volume& labels, double reach_mm, const Task& task) {
    PALPATE_TRY(const BrickMaker padded,
                pad_bricks(labels, glm::ivec3(kGuideMargin), glm::ivec3(kGuideMargin), 0.0));
    PALPATE_TRY(const Volume mask, make_bricks(padded, task.part(0.0, 0.2)));
    const glm::dvec3 spacing = spacing_mm(labels.grid());
    const float half_mm = 0.5f * float(std::min({spacing.x, spacing.y, spacing.z}));
    PALPATE_TRY(const Volume distance,
                signed_distance(mask, {.max_mm = reach_mm + double{half_mm}}, task.part(0.2, 0.9)));
    return map_values<float>(
        std::array{&distance}, task.part(0.9, 1.0), [&](std::array<float, 1> d) {
            return d[0] - std::copysign(std::min(half_mm, std::abs(d[0])), d[0]);
        });
}

// With samples between its own, until none is farther from the next than sample_mm.
Result<Volume> refined(const Volume& volume, double sample_mm, const Task& task) {
    const glm::dvec3 spacing = spacing_mm(volume.grid());
    Grid grid = volume.grid();
    for (int k = 0; k < 3; ++k) {
        const auto parts = uint32_t(std::clamp(std::ceil(spacing[k] / sample_mm), 1.0, 16.0));
        grid.size[k] = (grid.size[k] - 1) * parts + 1;
        grid.world_from_index[k] /= double(parts);
    }
    if (grid.size == volume.size() || sample_count(grid) > kMostGuideSamples)
        return volume;
    return resample(volume, {grid, ResampledBy::cubic, 0.0}, task);
}

// The median of at most some 64^3 samples, evenly spread; 0 where none has data.
double median_of(const Volume& volume) {
    const glm::uvec3 step = glm::max(volume.size() / 64u, 1u);
    std::vector<float> values;
    for (uint32_t z = 0; z < volume.size().z; z += step.z)
        for (uint32_t y = 0; y < volume.size().y; y += step.y)
            for (uint32_t x = 0; x < volume.size().x; x += step.x)
                if (const float value = volume.value({x, y, z}); std::isfinite(value))
                    values.push_back(value);
    if (values.empty())
        return 0.0;
    const auto middle = values.begin() + ptrdiff_t(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return double{*middle};
}

// Finds the place where `strength`, the length of the gradient of `smooth`, is largest along it.
class EdgeFinder {
 public:
    EdgeFinder(const Volume& smooth, const Volume& strength, float least)
        : smooth_(smooth), strength_(strength), least_(least) {
        const glm::dvec3 spacing = spacing_mm(smooth.grid());
        step_mm_ = std::min({spacing.x, spacing.y, spacing.z});
        index_from_world_ = glm::inverse(glm::dmat3(smooth.grid().world_from_index));
    }

    BrickPtr brick(glm::uvec3 position) const {
        static const BrickPtr none = constant_brick(ScalarType::u8, 0.0f);
        if (!(strength_.brick(position).range().max >= least_))
            return none;
        thread_local std::vector<float> smooth(kSamples), strength(kSamples);
        const glm::ivec3 first = glm::ivec3(position * kBrickSide) - kHalo;
        const auto layout = packed(glm::uvec3(kSide));
        read_box(smooth_, first, glm::ivec3(kSide), layout, smooth.data());
        read_box(strength_, first, glm::ivec3(kSide), layout, strength.data());
        std::vector<uint8_t> edges(kBrickSamples);
        const glm::uvec3 valid = smooth_.valid_in_brick(position);
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x)
                    edges[offset_in_brick({x, y, z})] =
                        is_edge(smooth.data(), strength.data(), glm::ivec3(x, y, z) + kHalo);
        return Brick::make(std::span<const uint8_t>(edges), valid);
    }

 private:
    static constexpr int kHalo = 2, kSide = int(kBrickSide) + 2 * kHalo;
    static constexpr size_t kSamples = size_t{kSide} * kSide * kSide;

    static size_t number(glm::ivec3 at) {
        return size_t(at.x) + size_t{kSide} * (size_t(at.y) + size_t{kSide} * size_t(at.z));
    }
    static double between(const float* samples, glm::dvec3 at) {
        const glm::ivec3 low(glm::floor(at));
        const glm::dvec3 part = at - glm::dvec3(low);
        double sum = 0.0;
        for (int i = 0; i < 8; ++i) {
            const glm::ivec3 corner(i & 1, i >> 1 & 1, i >> 2);
            const glm::dvec3 share = glm::mix(1.0 - part, part, glm::dvec3(corner));
            sum += share.x * share.y * share.z * double{samples[number(low + corner)]};
        }
        return sum;
    }
    bool is_edge(const float* smooth, const float* strength, glm::ivec3 at) const {
        const double here = strength[number(at)];
        if (!(here >= double{least_}))
            return false;
        glm::dvec3 slope;
        for (int k = 0; k < 3; ++k) {
            glm::ivec3 step(0);
            step[k] = 1;
            slope[k] = double{smooth[number(at + step)]} - double{smooth[number(at - step)]};
        }
        const glm::dvec3 along = world_gradient(smooth_.grid(), slope);
        if (!(glm::length(along) > 0.0))
            return false;
        // At most a sample on each axis. Beside no data nothing is larger.
        const glm::dvec3 step = index_from_world_ * (step_mm_ * glm::normalize(along));
        return !(between(strength, glm::dvec3(at) + step) > here) &&
               !(between(strength, glm::dvec3(at) - step) > here);
    }

    const Volume &smooth_, &strength_;
    float least_;
    double step_mm_;
    glm::dmat3 index_from_world_;
};

} // namespace

Result<Volume> guide_to_labels(const Volume& labels, double reach_mm, const Task& task) {
    if (!(labels.range().max > 0.0f))
        return fail("guide: expected a sample with a label, found none");
    return distance_to(labels, reach_mm, task);
}

Result<Volume> guide_to_edges(const Volume& volume, const GuideToEdges& options, const Task& task) {
    PALPATE_TRY(const Volume fine, refined(volume, options.sample_mm, task.part(0.0, 0.2)));
    PALPATE_TRY(const Volume smooth, gaussian(fine, {options.sigma_mm}, task.part(0.2, 0.35)));
    PALPATE_TRY(const Volume strength,
                gradient_magnitude(fine, {options.sigma_mm}, task.part(0.35, 0.5)));
    const double least = options.least > 0.0 ? options.least : 3.0 * median_of(strength);
    const EdgeFinder finder(smooth, strength, float(least));
    PALPATE_TRY(const Volume edges, make_bricks(fine.grid(), ScalarType::u8, task.part(0.5, 0.7),
                                                [&](glm::uvec3 at) { return finder.brick(at); }));
    if (!(edges.range().max > 0.0f))
        return fail("guide: found no edge whose gradient is at least {:g} a mm", least);
    return distance_to(edges, options.reach_mm, task.part(0.7, 1.0));
}

Result<Volume> guide_to_plane(const Grid& grid, glm::dvec3 point_mm, glm::dvec3 normal) {
    PALPATE_TRY(check_grid(grid));
    if (!(glm::length(normal) > 1e-9))
        return fail("guide: expected a plane's normal, found one of no length");
    const glm::dvec3 unit = glm::normalize(normal);
    constexpr uint32_t kSide = 16;
    const glm::dvec3 last = glm::dvec3(grid.size) - 1.0;
    const glm::dvec3 step = glm::max(last, 1.0) / double(kSide - 1 - 2 * kGuideMargin);
    Grid coarse = grid;
    coarse.size = glm::uvec3(kSide);
    for (int k = 0; k < 3; ++k)
        coarse.world_from_index[k] *= step[k];
    const glm::dvec3 first = world_point(grid, -double(kGuideMargin) * step);
    coarse.world_from_index[3] = glm::dvec4(first, 1.0);
    return make_volume(coarse, ScalarType::f32, [&](glm::uvec3 at) {
        return glm::dot(world_point(coarse, glm::dvec3(at)) - point_mm, unit);
    });
}

} // namespace palpate
