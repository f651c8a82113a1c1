#include "engine/program/figure_options.h"

#include <algorithm>
#include <filesystem>

#include "engine/annotate/legend_width.h"
#include "engine/base/option_name.h"
#include "engine/program/option_checks.h"
#include "engine/session/default_scene.h"

namespace palpate {

bool FigureOptions::has(const std::string& mark) const {
    return std::find(marks.begin(), marks.end(), mark) != marks.end() ||
           std::find(marks.begin(), marks.end(), "all") != marks.end();
}

void add_figure_options(CLI::App& app, FigureOptions& o) {
    app.add_option("--annotate", o.marks,
                   "Marks for figures, separated by commas: letters (sides of the patient), "
                   "scale-bar, color-bar, note (name, slice, window), legend (names and colours of "
                   "the labels "
                   "in the picture), or all (default: none)")
        ->delimiter(',')
        ->check(one_of({"letters", "scale-bar", "color-bar", "note", "legend", "all"}));
    app.add_option("--text-size", o.text_px,
                   "With --annotate: height of a line of text in pixels (default: 1/26 of the "
                   "picture's height)")
        ->check(within(4.0, 1000.0));
}

Figure figure_of(const FigureOptions& o, const OpenedScene& opened, bool transparent, bool moves) {
    const Scene& scene = opened.scene;
    const glm::dvec3 b = scene.background;
    const bool bright = transparent || 0.2126 * b.x + 0.7152 * b.y + 0.0722 * b.z > 0.5;
    const std::string unit = value_unit(opened.loaded);
    const std::string& volume = opened.file.volume;
    const std::string name =
        is_synthetic(volume) ? volume : std::filesystem::path(volume).filename().string();
    return {
        .letters = o.has("letters"),
        .scale_bar = o.has("scale-bar"),
        .color_bar = o.has("color-bar"),
        .note = o.has("note") ? note_of(scene, opened.loaded.data.volume.grid(), name, unit)
                              : std::vector<std::string>(),
        .legend = o.has("legend") ? legend_of(scene, opened.loaded) : std::vector<LegendEntry>(),
        .unit = unit,
        .ink = !moves   ? FigureInk::by_picture
               : bright ? FigureInk::dark
                        : FigureInk::bright,
        .transparent = transparent,
        .line_px = o.text_px};
}

void make_room_for_legend(const FigureOptions& options, const SceneOptions& chosen,
                          OpenedScene& opened) {
    Scene& scene = opened.scene;
    const bool is_lone_slice =
        scene.slices.size() == 1 && !scene.ray_cast && scene.surfaces.empty();
    if (!options.has("legend") || !is_lone_slice || scene.stereo || has_scene(chosen.input) ||
        !chosen.camera.empty() || !chosen.view.empty() || chosen.projection)
        return;
    const Figure figure{.legend = legend_of(scene, opened.loaded), .line_px = options.text_px};
    const glm::dvec2 size(scene.size_px);
    const double taken = legend_width_px(figure, scene.size_px);
    if (taken == 0.0 || taken > 0.5 * size.x)
        return;
    // The slice begins so many pixels from the left.
    const auto slice_begins = [&](const Camera& camera) {
        const View view = make_view(camera, scene.size_px);
        const Grid& grid = opened.loaded.data.volume.grid();
        double left = size.x;
        for (int corner = 0; corner < 8; ++corner) {
            const glm::dvec3 index = (glm::dvec3(grid.size) - 1.0) *
                                     glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2);
            const double along = glm::dot(view.right, world_point(grid, index) - view.eye_mm);
            left = std::min(left, (along - view.left) / (view.right_edge - view.left) * size.x);
        }
        return left;
    };
    if (slice_begins(scene.camera) >= taken)
        return;
    Scene beside = scene; // what is left of the picture
    beside.size_px.x -= static_cast<uint32_t>(taken);
    scene.camera = default_camera(beside, opened.loaded.data);
    const double missing = std::max(0.0, taken - slice_begins(scene.camera));
    const glm::dvec3 shift = missing * scene.camera.view_height_mm / size.y *
                             make_view(scene.camera, scene.size_px).right;
    scene.camera.eye_mm -= shift;
    scene.camera.target_mm -= shift;
}

std::string idle_mark(const FigureOptions& o, const OpenedScene& opened) {
    const auto asked = [&](const char* mark) {
        return std::find(o.marks.begin(), o.marks.end(), mark) != o.marks.end();
    };
    if (asked("color-bar") && !color_function(opened.scene))
        return fmt::format(
            "{} color-bar: without effect, because no window or transfer function "
            "colours this picture",
            Option{"annotate"});
    if (asked("legend") && legend_of(opened.scene, opened.loaded).empty())
        return fmt::format("{} legend: without effect, because the picture shows no labels",
                           Option{"annotate"});
    return "";
}

} // namespace palpate
