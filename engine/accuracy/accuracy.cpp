#include "engine/scene/accuracy.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/assert.h"
#include "engine/scene/scene_names.h"

namespace palpate {

namespace {

constexpr MeasuredSetting kMeasured[] = {
#include "engine/scene/accuracy_table.inc"
};

// The table's entry beside a value.
size_t entry_of(const TransferTable& table, double value) {
    const double last = static_cast<double>(table.entries.size() - 1);
    const double x = (value - table.low) / (table.high - table.low);
    return static_cast<size_t>(std::clamp(x, 0.0, 1.0) * last + 0.5);
}

// In values: what colour or extinction needs to change by all of itself at its steepest; not less
// than an entry of the table.
double detail_of(const TransferTable& table) {
    double largest = 0.0, steepest = 0.0, color_steepest = 0.0;
    for (size_t i = 0; i < table.entries.size(); ++i) {
        largest = std::max<double>(largest, table.entries[i].w);
        if (i == 0)
            continue;
        const glm::vec4 d = glm::abs(table.entries[i] - table.entries[i - 1]);
        steepest = std::max<double>(steepest, d.w);
        if (table.entries[i].w > 0.0f || table.entries[i - 1].w > 0.0f)
            color_steepest = std::max<double>(color_steepest, std::max({d.x, d.y, d.z}));
    }
    const double change = std::max(largest > 0.0 ? steepest / largest : 0.0, color_steepest);
    const double entry = (table.high - table.low) / static_cast<double>(table.entries.size() - 1);
    return change > 0.0 ? std::max(entry / change, entry) : std::numeric_limits<double>::infinity();
}

} // namespace

std::string text_of(const RaySetting& setting) {
    for (const auto& [name, value] : Names<Integrator>::list)
        if (value == setting.integrator)
            return value == Integrator::exact
                       ? fmt::format("{}, {} sub-steps", name, setting.sub_steps)
                       : fmt::format("{}, steps of {} voxels", name, setting.step_voxels);
    return "";
}

void apply(const RaySetting& setting, const Grid& grid, RayCastLayer& layer) {
    layer.integrator = setting.integrator;
    if (setting.integrator == Integrator::exact) {
        layer.sub_steps = setting.sub_steps;
    } else {
        layer.step_mm = 0.0;
        layer.step_mm = setting.step_voxels * step_mm_of(layer, grid);
    }
}

double sharpness_of(const TransferFunction& function, const Volume& volume) {
    const TransferTable table = make_table(function);
    std::vector<uint32_t> visible{0}; // entries with opacity before this one
    for (const glm::vec4& entry : table.entries)
        visible.push_back(visible.back() + (entry.w > 0.0f ? 1 : 0));
    const glm::uvec3 size = volume.size();
    const glm::dvec3 spacing = spacing_mm(volume.grid());
    const double finest = std::min({spacing.x, spacing.y, spacing.z});
    // At most about a million places, the same ones every time; strides that share no factor with
    // the sides of bricks.
    const double places = static_cast<double>(size.x) * size.y * size.z;
    const uint32_t stride = 1 + 2 * static_cast<uint32_t>(std::cbrt(places / 1e6) / 2.0);
    double sum = 0.0, count = 0.0;
    for (uint32_t z = 0; z < size.z; z += stride)
        for (uint32_t y = 0; y < size.y; y += stride)
            for (uint32_t x = 0; x < size.x; x += stride) {
                const glm::uvec3 here(x, y, z);
                const double value = volume.value(here);
                for (int axis = 0; axis < 3; ++axis) {
                    glm::uvec3 there = here;
                    if (++there[axis] >= size[axis])
                        continue;
                    const double beside = volume.value(there);
                    if (std::isnan(value) || std::isnan(beside))
                        continue;
                    if (visible[entry_of(table, std::max(value, beside)) + 1] ==
                        visible[entry_of(table, std::min(value, beside))])
                        continue;
                    const double change = (beside - value) * finest / spacing[axis];
                    sum += change * change;
                    count += 1.0;
                }
            }
    return count > 0.0 ? std::sqrt(sum / count) / detail_of(table) : 0.0;
}

SceneKind kind_of(const RayCastLayer& layer) {
    switch (layer.mode) {
        case RayMode::mip:
            return SceneKind::mip;
        case RayMode::iso:
            return SceneKind::iso;
        case RayMode::alpha:
            break;
    }
    return layer.shading ? SceneKind::shaded_alpha : SceneKind::alpha;
}

size_t sharpness_class(double sharpness) {
    size_t c = 0;
    while (c + 1 < kSharpnessClasses && sharpness > std::ldexp(1.0, static_cast<int>(c) - 4))
        ++c;
    return c;
}

std::span<const MeasuredSetting> measured_settings() {
    return kMeasured;
}

namespace {

// What decides which of the table's numbers holds for a scene.
struct Key {
    SceneKind of;
    size_t kind, sharpness_class;
    double filter_error;
    bool labels;

    // Empty where it was not measured: where a label ends, only `exact` cuts. Maxima and surfaces
    // have no sub-steps.
    std::optional<double> estimate(const MeasuredSetting& measured) const {
        const bool exact = measured.setting.integrator == Integrator::exact;
        const bool pieces = of == SceneKind::alpha || of == SceneKind::shaded_alpha;
        if ((labels && !exact) || (exact && !pieces && measured.setting.sub_steps > 1))
            return std::nullopt;
        return kAccuracyMargin * measured.rmse[kind][sharpness_class] +
               (exact ? 0.0 : filter_error);
    }
};

Key key_of(const Scene& scene, const SceneData& data, double weight_error) {
    PALPATE_ASSERT(scene.ray_cast.has_value());
    const RayCastLayer& layer = *scene.ray_cast;
    const double sharpness =
        layer.mode == RayMode::iso ? 0.0 : sharpness_of(layer.transfer, data.volume);
    const SceneKind kind = kind_of(layer);
    return {kind, static_cast<size_t>(kind),
            std::min(sharpness_class(sharpness) + kClassesAbove, kSharpnessClasses - 1),
            weight_error * sharpness, scene.labels.has_value()};
}

} // namespace

Result<AccuracyChoice> choose_setting(const Scene& scene, const SceneData& data, double error,
                                      double weight_error) {
    const Key key = key_of(scene, data, weight_error);
    const double min_transmittance = std::min(scene.ray_cast->min_transmittance, 0.25 * error);
    const MeasuredSetting *fastest = nullptr, *finest = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (const MeasuredSetting& measured : measured_settings()) {
        const std::optional<double> estimate = key.estimate(measured);
        if (!estimate)
            continue;
        if (*estimate < least) {
            least = *estimate;
            finest = &measured;
        }
        if (*estimate + min_transmittance <= error &&
            (!fastest || measured.cost[key.kind] < fastest->cost[key.kind]))
            fastest = &measured;
    }
    if (!fastest) { // a quarter of what is asked for goes to early termination
        const double unit = std::pow(10.0, std::floor(std::log10(least / 0.75)) - 1.0);
        return fail(
            "--error: expected at least {:.1e}, the best that can be had for this scene "
            "(by {}), found {:g}",
            std::ceil(least / 0.75 / unit) * unit, text_of(finest->setting), error);
    }
    return AccuracyChoice{fastest->setting, min_transmittance,
                          *key.estimate(*fastest) + min_transmittance};
}

std::optional<double> estimated_error(const Scene& scene, const SceneData& data,
                                      double weight_error) {
    const RayCastLayer& layer = *scene.ray_cast;
    const Key key = key_of(scene, data, weight_error);
    RayCastLayer open = layer;
    open.step_mm = 0.0;
    const double voxels =
        step_mm_of(layer, data.volume.grid()) / step_mm_of(open, data.volume.grid());
    std::optional<double> best; // of the settings that are no finer
    for (const MeasuredSetting& measured : measured_settings()) {
        const RaySetting& setting = measured.setting;
        const bool coarser = setting.integrator == Integrator::exact
                                 ? setting.sub_steps <= layer.sub_steps
                                 : setting.step_voxels >= voxels * (1.0 - 1e-9);
        const std::optional<double> estimate = key.estimate(measured);
        if (setting.integrator == layer.integrator && coarser && estimate)
            best = std::min(best.value_or(*estimate), *estimate);
    }
    return best ? std::optional(*best + layer.min_transmittance) : best;
}

} // namespace palpate
