#include "engine/session/default_scene.h"

#include <algorithm>

#include "engine/base/option_name.h"
#include "engine/io/hounsfield.h"
#include "engine/scene/presets.h"
#include "engine/session/bright_background.h"

namespace palpate {

namespace {

// Steps of alpha in voxels. At 1, shells of the step are seen in thin and steep matter; 0.5 costs
// twice the time for a third of the error (palpate_ray_costs, shaded alpha).
constexpr double kAlphaStep_voxels = 0.5;

constexpr glm::dvec2 kTissue_hu(-160.0, 240.0); // the soft-tissue window
constexpr double kDenseBone_hu = 200.0, kBone_hu = 300.0;
constexpr double kSkin_hu = -300.0; // between air and fat, and above the rims of foam

ValueSurvey survey_of(const LoadedScene& loaded) {
    return survey_of(loaded.data.volume, loaded.coarser);
}

// The number to take from values to get Hounsfield units; nothing where they are not a CT's.
std::optional<double> hounsfield_offset(const LoadedScene& loaded, const ValueSurvey& values) {
    if (loaded.modality == "CT")
        return lacks_ct_offset(loaded.modality, loaded.data.volume, values) ? kLostCtOffset : 0.0;
    return loaded.modality.empty() && values.like_hounsfield ? std::optional(0.0) : std::nullopt;
}

// The facts that a default scene is chosen by.
struct Look {
    ValueSurvey values;
    std::optional<double> hu; // where a CT has its 0 HU
    // A background that is brighter than bone, or than all else in data without a unit, hides what
    // lies in it from rays that look for what is bright. Small values may be meant to be bright,
    // too.
    bool looks_for_dark;

    explicit Look(const LoadedScene& loaded)
        : values(survey_of(loaded)),
          hu(hounsfield_offset(loaded, values)),
          looks_for_dark(
              (loaded.inverted && !hu) ||
              (values.bright_background && (!hu || *values.bright_background >= *hu + kBone_hu))) {}

    double highest() const { return std::max(values.high, values.projected_high); }
    // Whether the values spread over an eighth of a window in HU, 32 of 256 greys.
    bool fills(double low_hu, double high_hu) const {
        const double least = std::min(values.low, values.lower_percent);
        return hu && std::min(highest(), *hu + high_hu) - std::max(least, *hu + low_hu) >=
                         0.125 * (high_hu - low_hu);
    }
    bool fills_tissue() const { return fills(kTissue_hu.x, kTissue_hu.y); }
};

// `mr` over the values.
TransferFunction over_values(const TransferFunction& function, const Look& look) {
    const ValueSurvey& values = look.values;
    return look.looks_for_dark ? stretched(function, values.high, values.low)
                               : stretched(function, values.low, values.high);
}

// The function of mode alpha: bone, or soft tissue where nothing is as dense as bone.
TransferFunction alpha_preset(const Look& look) {
    if (look.looks_for_dark || !look.fills_tissue())
        return over_values(*preset("mr"), look);
    const bool has_bone = look.highest() >= *look.hu + kDenseBone_hu;
    return stretched(*preset(has_bone ? "ct-bone" : "ct-soft-tissue"), *look.hu, *look.hu + 1000.0);
}

// From white at `low` to black at `high`: a MIP then shows the smallest value.
TransferFunction window_of_dark(double low, double high) {
    return {{{low, glm::dvec3(1.0)}, {high, glm::dvec3(0.0)}}, {{low, 1.0}, {high, 0.0}}, 1.0};
}

// A grey function of a volume whose small values may be meant to be bright.
TransferFunction as_meant(const TransferFunction& function, const LoadedScene& loaded) {
    return loaded.inverted ? mirrored(function) : function;
}

} // namespace

double zero_hu(const LoadedScene& loaded) {
    const LoadedScene& l = loaded;
    return lacks_ct_offset(l.modality, l.data.volume, l.coarser) ? kLostCtOffset : 0.0;
}

std::string value_unit(const LoadedScene& loaded) {
    return loaded.modality == "CT" && zero_hu(loaded) == 0.0 ? "HU" : "";
}

std::optional<double> bone_value(const LoadedScene& loaded) {
    const std::optional<double> zero = hounsfield_offset(loaded, survey_of(loaded));
    return zero ? std::optional(*zero + kBone_hu) : std::nullopt;
}

std::optional<double> skin_value(const LoadedScene& loaded) {
    const std::optional<double> zero = hounsfield_offset(loaded, survey_of(loaded));
    return zero ? std::optional(*zero + kSkin_hu) : std::nullopt;
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

std::string told_of_bright_background(const LoadedScene& loaded) {
    const Look look(loaded);
    if (!look.looks_for_dark || !look.values.bright_background)
        return ""; // what is stored inverted is told by its reader
    return fmt::format(
        "its background of {:g} is brighter than what lies in it, so by default rays look for dark "
        "values: opaque in mode alpha, and the smallest in mode mip ({} LOW,HIGH looks for "
        "bright ones)",
        *look.values.bright_background, Option{"window"});
}

TransferFunction fitted(TransferFunction function, const std::string& preset_name,
                        const LoadedScene& loaded) {
    const Look look(loaded);
    const double zero = look.hu.value_or(0.0);
    function = preset_name == "mr" ? over_values(function, look)
                                   : stretched(function, zero, zero + 1000.0);
    function.opacity_unit_mm = preset_unit_mm(loaded.data.volume.grid());
    return function;
}

RayCastLayer default_ray_cast(RayMode mode, const LoadedScene& loaded) {
    const Look look(loaded);
    const ValueSurvey& values = look.values;
    const Grid& grid = loaded.data.volume.grid();
    RayCastLayer layer;
    layer.mode = mode;
    if (mode == RayMode::mip) {
        if (look.looks_for_dark)
            layer.transfer = window_of_dark(values.projected_low, values.high);
        else if (look.fills(-200.0, 300.0))
            layer.transfer =
                as_meant(window_function(*look.hu - 200.0,
                                         std::max(values.projected_high, *look.hu + 300.0), 1.0),
                         loaded);
        else
            layer.transfer =
                as_meant(window_function(values.low, values.projected_high, 1.0), loaded);
        return layer;
    }
    layer.transfer = alpha_preset(look);
    layer.transfer.opacity_unit_mm = preset_unit_mm(grid);
    layer.shading = Shading{};
    const double in_values = 0.35 * (values.high - values.low);
    if (mode == RayMode::iso)
        layer.isos = iso_surfaces({look.looks_for_dark ? values.high - in_values
                                   : look.hu           ? *look.hu + kBone_hu
                                                       : values.low + in_values});
    else
        layer.step_mm = kAlphaStep_voxels * step_mm_of(layer, grid);
    return layer;
}

TransferFunction default_slice_transfer(const LoadedScene& loaded) {
    const Look look(loaded);
    if (look.fills_tissue())
        return as_meant(window_function(*look.hu + kTissue_hu.x, *look.hu + kTissue_hu.y, 1.0),
                        loaded);
    return as_meant(window_function(look.values.low, look.values.high, 1.0), loaded);
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
