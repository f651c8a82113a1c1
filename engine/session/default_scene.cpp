#include "engine/session/default_scene.h"

#include <algorithm>

#include "engine/io/hounsfield.h"
#include "engine/scene/presets.h"

namespace palpate {

namespace {

// Steps of alpha in voxels. At 1, shells of the step are seen in thin and steep matter; 0.5 costs
// twice the time for a third of the error (palpate_ray_costs, shaded alpha).
constexpr double kAlphaStep_voxels = 0.5;

ValueSurvey survey_of(const LoadedScene& loaded) {
    return survey_of(loaded.data.volume, loaded.coarser);
}

// What has to be taken from values to get Hounsfield units; nothing where they are not a CT's.
std::optional<double> hounsfield_offset(const LoadedScene& loaded, const ValueSurvey& values) {
    if (loaded.modality == "CT")
        return lacks_ct_offset(loaded.modality, loaded.data.volume, values) ? kLostCtOffset : 0.0;
    const bool likely = loaded.modality.empty() && values.lower_percent < -200.0 &&
                        values.high < 4000.0; // metal ends at 3071 where 12 bits do
    return likely ? std::optional(0.0) : std::nullopt;
}

// A function of HU, or of 0 .. 1000 for data without a unit, as it suits the volume.
TransferFunction moved(const TransferFunction& function, bool in_hu, const ValueSurvey& values,
                       std::optional<double> offset) {
    if (!in_hu)
        return stretched(function, values.low, values.high);
    return stretched(function, offset.value_or(0.0), offset.value_or(0.0) + 1000.0);
}

} // namespace

double zero_hu(const LoadedScene& loaded) {
    const LoadedScene& l = loaded;
    return lacks_ct_offset(l.modality, l.data.volume, l.coarser) ? kLostCtOffset : 0.0;
}

std::string value_unit(const LoadedScene& loaded) {
    return loaded.modality == "CT" && zero_hu(loaded) == 0.0 ? "HU" : "";
}

bool is_label_map(const LoadedScene& loaded) {
    return loaded.modality.empty() && looks_like_labels(loaded.data.volume, survey_of(loaded));
}

std::optional<SliceLayer> only_slice(const Grid& grid) {
    const glm::dmat3 axes(grid.world_from_index);
    for (int axis = 0; axis < 3; ++axis)
        if (grid.size[axis] == 1)
            // Across the other two: a sheared axis does not stand on them.
            return SliceLayer{
                .point_mm = center_mm(grid),
                .normal = glm::normalize(glm::cross(axes[(axis + 1) % 3], axes[(axis + 2) % 3]))};
    return std::nullopt;
}

TransferFunction fitted(TransferFunction function, const std::string& preset_name,
                        const LoadedScene& loaded) {
    const ValueSurvey values = survey_of(loaded);
    function = moved(function, preset_name != "mr", values, hounsfield_offset(loaded, values));
    function.opacity_unit_mm = preset_unit_mm(loaded.data.volume.grid());
    return function;
}

RayCastLayer default_ray_cast(RayMode mode, const LoadedScene& loaded) {
    const ValueSurvey values = survey_of(loaded);
    const std::optional<double> hu = hounsfield_offset(loaded, values);
    const Grid& grid = loaded.data.volume.grid();
    RayCastLayer layer;
    layer.mode = mode;
    if (mode == RayMode::mip) {
        const double low = hu ? *hu - 200.0 : values.low;
        const double high =
            hu ? std::max(values.projected_high, *hu + 300.0) : values.projected_high;
        layer.transfer = window_function(low, high, 1.0);
        return layer;
    }
    layer.transfer = moved(*preset(hu ? "ct-bone" : "mr"), hu.has_value(), values, hu);
    layer.transfer.opacity_unit_mm = preset_unit_mm(grid);
    layer.shading = Shading{};
    if (mode == RayMode::iso)
        layer.isos =
            iso_surfaces({hu ? *hu + 300.0 : values.low + 0.35 * (values.high - values.low)});
    else
        layer.step_mm = kAlphaStep_voxels * step_mm_of(layer, grid);
    return layer;
}

TransferFunction default_slice_transfer(const LoadedScene& loaded) {
    const ValueSurvey values = survey_of(loaded);
    if (const std::optional<double> hu = hounsfield_offset(loaded, values))
        return window_function(*hu - 160.0, *hu + 240.0, 1.0);
    return window_function(values.low, values.high, 1.0);
}

TransferFunction default_fusion_transfer(ValueRange range) {
    const double low = range.empty() ? 0.0 : range.min;
    const double width = !range.empty() && range.min < range.max ? double{range.max} - low : 1.0;
    const auto at = [&](double share) { return low + share * width; };
    return {.colors = {{at(0.0), {0.0, 0.0, 0.0}},
                       {at(0.35), {0.9, 0.0, 0.0}},
                       {at(0.7), {1.0, 0.9, 0.0}},
                       {at(1.0), {1.0, 1.0, 1.0}}},
            .opacities = {{at(0.1), 0.0}, {at(0.33), 1.0}},
            .opacity_unit_mm = 1.0};
}

glm::dvec3 surface_color(size_t number) {
    constexpr glm::dvec3 colors[] = {{1.0, 0.94, 0.85}, {0.90, 0.62, 0.50}, {0.6, 0.8, 1.0},
                                     {0.7, 0.95, 0.6},  {1.0, 0.9, 0.4},    {0.85, 0.6, 0.95},
                                     {0.5, 0.9, 0.85},  {1.0, 0.6, 0.6}};
    return colors[number % std::size(colors)];
}

std::vector<IsoSurface> iso_surfaces(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
    std::vector<IsoSurface> isos;
    for (size_t i = 0; i < values.size(); ++i) {
        const size_t from_inside = values.size() - 1 - i;
        isos.push_back({values[i], surface_color(from_inside), from_inside == 0 ? 1.0 : 0.35});
    }
    return isos;
}

} // namespace palpate
