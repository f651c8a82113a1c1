#include "apps/view/window/state.h"

#include <algorithm>
#include <cmath>

namespace palpate::view {

GreyWindow limited(GreyWindow window, ValueRange range) {
    constexpr double kNarrowest = 1e-6, kWidest = 1e3, kFarthest = 1e3; // of the values' range
    const double span = std::max(1e-6, double{range.max} - range.min);
    const auto within = [&](double value) {
        return std::clamp(value, range.min - kFarthest * span, range.max + kFarthest * span);
    };
    const double low = within(window.low), high = within(window.high);
    const double level = 0.5 * (low + high);
    const double size = std::max(std::abs(range.min), std::abs(range.max)); // of their rounding
    const double least = std::max(kNarrowest * span, 1e-9 * size);
    const double width = std::clamp(high - low, least, std::max(least, kWidest * span));
    if (width == window.high - window.low && low == window.low)
        return window; // not a bit of it changes
    return {level - 0.5 * width, level + 0.5 * width};
}

GreyWindow with_low(GreyWindow window, double low, double least, GreyWindow limits) {
    if (std::isnan(low))
        return window;
    const double width = std::max(window.high - window.low, least);
    low = std::clamp(low, limits.low, limits.high - least);
    // A drag that ends at the other end less `least` may be past it by its rounding.
    const bool passes = low > window.high - 0.5 * least;
    return {low, passes ? std::min(low + width, limits.high) : std::max(window.high, low + least)};
}

GreyWindow with_high(GreyWindow window, double high, double least, GreyWindow limits) {
    const auto mirrored = [](GreyWindow w) { return GreyWindow{-w.high, -w.low}; };
    return mirrored(with_low(mirrored(window), -high, least, mirrored(limits)));
}

bool is_shown(const ViewState& state, Section section) {
    return state.tools_open && state.task == entry_of(section).task && state.sections.has(section);
}

bool has_touch_panel(const ViewState& state) {
    return state.touch_open && !(state.tools_open && state.task == WindowTask::drill);
}

Places places_of(const ViewState& state) {
    const auto places = [&](glm::uvec2 size_px) {
        return places_of(size_px, state.layout, state.slice, state.alone,
                         {state.tools_open, has_touch_panel(state), state.bars_open, state.panel_px,
                          state.task == WindowTask::segment ? kFoot_px : 0.0},
                         state.text_scale);
    };
    Places all = places(state.size_px);
    if (!state.status_open) { // it lies below the window
        all = places(state.size_px + glm::uvec2(0, all.status.size_px.y));
        all.status = {};
    }
    return all;
}

std::optional<Box> box_of(const ViewState& state, Panel panel) {
    for (const Places::View& view : places_of(state).views)
        if (view.panel == panel)
            return view.box;
    return std::nullopt;
}

double extent_mm(const Grid& grid) {
    return glm::length(glm::dmat3(grid.world_from_index) * glm::dvec3(grid.size));
}

glm::uvec2 volume_size_px(const ViewState& state) {
    const std::optional<Box> box = box_of(state, Panel::volume);
    return glm::uvec2(
        glm::max(box ? box->size_px : places_of(state).views.front().box.size_px, glm::ivec2(1)));
}

glm::dvec3 point_under(const ViewState& state, const Grid& grid, Panel panel, glm::dvec2 at_px) {
    const Box box = box_of(state, panel).value();
    return point_under(state.slices[static_cast<size_t>(panel)], state.crosshair_mm, grid,
                       box.size_px, at_px - glm::dvec2(box.low_px));
}

std::optional<glm::dvec2> pixel_of(const ViewState& state, const Grid& grid, Panel panel,
                                   glm::dvec3 point_mm) {
    const std::optional<Box> box = box_of(state, panel);
    if (!box)
        return std::nullopt;
    const std::optional<glm::dvec2> at =
        is_slice(panel)
            ? pixel_of(state.slices[static_cast<size_t>(panel)], grid, box->size_px, point_mm)
            : pixel_of(state.camera, box->size_px, point_mm);
    return at ? std::optional(*at + glm::dvec2(box->low_px)) : std::nullopt;
}

void page(ViewState& state, const Grid& grid, Panel panel, double layers) {
    const glm::dvec3 away = -state.slices[static_cast<size_t>(panel)].towards;
    move_crosshair(state, grid, state.crosshair_mm + layers * layer_step_mm(grid, away) * away);
}

std::optional<glm::uvec3> sample_at(const Grid& grid, glm::dvec3 point_mm) {
    const glm::dvec3 nearest = glm::round(index_point(grid, point_mm));
    for (int i = 0; i < 3; ++i)
        if (!(nearest[i] >= 0.0 && nearest[i] < static_cast<double>(grid.size[i])))
            return std::nullopt;
    return glm::uvec3(nearest);
}

void move_crosshair(ViewState& state, const Grid& grid, glm::dvec3 to_mm) {
    glm::dvec3 index =
        glm::clamp(index_point(grid, to_mm), glm::dvec3(0.0), glm::dvec3(grid.size) - 1.0);
    const bool along_samples =
        std::all_of(state.slices.begin(), state.slices.end(),
                    [&](const SliceView& slice) { return holds_samples(grid, slice.towards); });
    if (along_samples)
        index = glm::round(index);
    state.crosshair_mm = world_point(grid, index);
}

bool are_whole_enough(ValueRange range) {
    return double{range.max} - range.min >= 200.0;
}

TransferFunction grey_of(const ViewState& state) {
    const TransferFunction grey = window_function(state.window.low, state.window.high, 1.0);
    return state.window_inverted ? mirrored(grey) : grey;
}

namespace {

// Surfaces of labels in 3D, or none of them. Where there are some, rays are not tinted.
void show_label_surfaces(Scene& scene, bool shown) {
    const auto live =
        std::ranges::find_if(scene.surfaces, [](const auto& layer) { return layer.live_labels; });
    if (!shown) {
        for (SurfaceLayer& layer : scene.surfaces)
            if (layer.live_labels)
                layer.style.opacity = 0.0;
        return;
    }
    if (!scene.labels)
        return;
    if (live == scene.surfaces.end()) {
        if (scene.surfaces.size() == kMaxSurfaces)
            return;
        scene.surfaces.emplace_back().live_labels = true;
    }
    scene.labels->ray_cast_weight = 0.0;
}

} // namespace

Scene scene_of(const ViewState& state, const Grid& grid, Panel panel, const Scene& base,
               bool has_labels) {
    Scene scene = base;
    const std::optional<Box> box = box_of(state, panel);
    scene.size_px =
        glm::uvec2(glm::max(box ? box->size_px : glm::ivec2(volume_size_px(state)), glm::ivec2(1)));
    if (!has_labels || !state.labels_shown)
        scene.labels.reset();
    // Settings of slices change nothing of a volume without slices, and rays are not cast anew.
    if (is_slice(panel) || state.slices_in_volume) {
        scene.slice_transfer = grey_of(state);
        if (scene.labels)
            scene.labels->slice_opacity = state.label_opacity;
        for (std::optional<LabelLayer>* layer : {&scene.labels, &scene.overlay})
            if (*layer) {
                (*layer)->outline_px = state.outline_px;
                (*layer)->edges = state.label_edges;
            }
        if (scene.overlay)
            scene.overlay->slice_opacity = state.overlay_opacity;
        if (scene.fusion)
            scene.fusion->opacity = state.fusion_opacity;
    }
    scene.value_and_depth = false;
    scene.stereo.reset();
    scene.mirror = false;
    const auto plane = [&](const SliceView& slice) {
        return SliceLayer{.point_mm = point_of_plane(slice, state.crosshair_mm),
                          .normal = slice.towards,
                          .slab_mm = state.slab_mm,
                          .slab_mode = state.slab_mode};
    };
    if (is_slice(panel)) {
        const SliceView& slice = state.slices[static_cast<size_t>(panel)];
        scene.camera = camera_of(slice, state.crosshair_mm, grid, glm::ivec2(scene.size_px));
        scene.ray_cast.reset();
        scene.surfaces.clear();
        scene.clip_planes.clear();
        scene.background = glm::dvec3(0.0);
        scene.slices = {plane(slice)};
        return scene;
    }
    show_label_surfaces(scene, state.labels_in_3d);
    scene.camera = state.camera;
    show_to_both_eyes(scene, state.stereo);
    scene.slices.clear();
    if (!state.slices_in_volume) {
        scene.fusion.reset();
        scene.overlay.reset();
        return scene;
    }
    for (const SliceView& slice : state.slices)
        scene.slices.push_back(plane(slice));
    return scene;
}

} // namespace palpate::view
