#include "engine/program/render_warnings.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "engine/base/option_name.h"
#include "engine/program/option_checks.h"
#include "engine/session/default_scene.h"
#include "engine/volume/extent.h"
#include "engine/volume/thickness.h"

namespace palpate {

namespace {

using Sentences = std::vector<std::string>;

// The grid of the volume as it is drawn: a sample wide where it is one sample thick.
Grid drawn_grid(const SceneToDraw& d) {
    return thickened(d.loaded.data.volume.grid());
}

void add_isos(const SceneToDraw& d, Sentences& out) {
    std::vector<double> values;
    if (d.scene.ray_cast && d.scene.ray_cast->mode == RayMode::iso)
        for (const IsoSurface& surface : d.scene.ray_cast->isos)
            values.push_back(surface.value);
    for (const SurfaceSource& source : d.file.surfaces)
        if (source.iso)
            values.push_back(*source.iso);
    const ValueRange range = d.loaded.data.volume.range();
    std::erase_if(values, [&](double v) { return v >= range.min && v <= range.max; });
    if (!values.empty())
        out.push_back(
            fmt::format("nothing is drawn at the iso-value {:g}: expected one within {:g} .. {:g}",
                        fmt::join(values, ", "), range.min, range.max));
}

std::string plane_text(glm::dvec3 point, glm::dvec3 normal) {
    return fmt::format("{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g}", point.x, point.y, point.z,
                       normal.x, normal.y, normal.z);
}

// How far the corners of the sampled box lie before a plane, mm: the least and the most.
std::pair<double, double> before_plane(const Grid& grid, glm::dvec3 point, glm::dvec3 normal) {
    double least = INFINITY, most = -INFINITY;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 index =
            (glm::dvec3(grid.size) - 1.0) * glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2);
        const double mm = glm::dot(glm::normalize(normal), world_point(grid, index) - point);
        least = std::min(least, mm);
        most = std::max(most, mm);
    }
    return {least, most};
}

void add_slices(const SceneToDraw& d, Sentences& out) {
    const Grid grid = drawn_grid(d);
    const double slack = slack_mm(grid);
    const std::optional<SliceLayer> flat = only_slice(d.loaded.data.volume.grid());
    for (size_t i = 0; i < d.scene.slices.size(); ++i) {
        const SliceLayer& slice = d.scene.slices[i];
        const std::string name = d.options.slices.empty()
                                     ? fmt::format("slice {}", i + 1)
                                     : fmt::format("{} {}", Option{"slice"}, d.options.slices[i]);
        const auto [least, most] = before_plane(grid, slice.point_mm, slice.normal);
        const auto [first, last] =
            before_plane(d.loaded.data.volume.grid(), slice.point_mm, slice.normal);
        if (least > slack || most < -slack)
            out.push_back(fmt::format(
                "{} lies outside the volume, which is within {} (LPS), and draws nothing", name,
                text_of(world_box(grid))));
        else if (flat && last - first > (most - least) - (last - first)) // more than its thickness
            out.push_back(fmt::format(
                "{} cuts across the volume, which is one sample thick, and draws a strip; {} "
                "{} is the volume's own plane",
                name, Option{"slice"}, plane_text(flat->point_mm, flat->normal)));
    }
}

void add_clips(const SceneToDraw& d, Sentences& out) {
    const Grid grid = drawn_grid(d);
    const bool others = std::any_of(d.file.surfaces.begin(), d.file.surfaces.end(),
                                    [](const SurfaceSource& s) { return !s.mesh.empty(); });
    if (d.scene.clip_planes.empty() || others || (!d.scene.ray_cast && d.scene.surfaces.empty()))
        return;
    std::vector<HalfSpace> kept = half_spaces(grid);
    for (const ClipPlane& plane : d.scene.clip_planes) {
        kept.push_back({plane.normal, glm::dot(plane.normal, plane.point_mm)});
        if (before_plane(grid, plane.point_mm, plane.normal).first >= 0.0)
            out.push_back(fmt::format(
                "the clip plane {} cuts nothing away: all of the volume, within {} (LPS), is on "
                "the side it keeps",
                plane_text(plane.point_mm, plane.normal), text_of(world_box(grid))));
    }
    if (!have_common_point(kept, slack_mm(grid)))
        out.push_back(fmt::format("the clip plane{} keep{} nothing of the volume, within {} (LPS)",
                                  d.scene.clip_planes.size() == 1 ? "" : "s together",
                                  d.scene.clip_planes.size() == 1 ? "s" : "",
                                  text_of(world_box(grid))));
}

void add_labels(const SceneToDraw& d, Sentences& out) {
    if (!d.loaded.data.labels)
        return;
    const Volume& labels = *d.loaded.data.labels;
    if (labels.range().empty() || labels.range().max < 1.0f)
        out.push_back("the label map holds no label: all its samples are 0, the background");
}

// The colours or opacities of a transfer function at all values that the volume has.
void add_transfer(const SceneToDraw& d, Sentences& out) {
    const ValueRange range = d.loaded.data.volume.range();
    const auto same = [&](const TransferFunction& function, const auto& at) {
        const auto first = at(function, range.min);
        bool all = first == at(function, range.max);
        for (const double value : knots(function))
            all = all && (value < range.min || value > range.max || at(function, value) == first);
        return all;
    };
    const auto values =
        fmt::format("all of the volume's values, {:g} .. {:g},", range.min, range.max);
    if (range.min == range.max) {
        out.push_back(fmt::format("every sample of the volume has the value {:g}", range.min));
        return;
    }
    const RayCastLayer* rays = d.scene.ray_cast ? &*d.scene.ray_cast : nullptr;
    if (rays && rays->mode != RayMode::iso && same(rays->transfer, opacity_at) &&
        opacity_at(rays->transfer, range.min) == 0.0)
        out.push_back(values + " are transparent by the transfer function");
    else if (rays && rays->mode == RayMode::mip && same(rays->transfer, color_at))
        out.push_back(values + " have one colour by the window or transfer function");
    if (!d.scene.slices.empty() && same(d.scene.slice_transfer, color_at))
        out.push_back(values + " have one colour in slices by the window or transfer function");
}

// The space that a camera sees, from the plane through its eye on.
std::vector<HalfSpace> seen_by(const Camera& camera, glm::uvec2 size_px) {
    const View view = make_view(camera, size_px);
    const bool narrows = view.projection == Projection::perspective;
    std::vector<HalfSpace> seen;
    const auto add = [&](glm::dvec3 inward, double bound) { // dot(inward, p - eye) >= bound
        const glm::dvec3 normal = narrows ? inward - bound * view.forward : inward;
        seen.push_back({normal, glm::dot(normal, view.eye_mm) + (narrows ? 0.0 : bound)});
    };
    add(view.right, view.left);
    add(-view.right, -view.right_edge);
    add(view.up, view.bottom);
    add(-view.up, -view.top);
    seen.push_back({view.forward, glm::dot(view.forward, view.eye_mm)});
    return seen;
}

void add_camera(const SceneToDraw& d, Sentences& out) {
    const bool others = std::any_of(d.file.surfaces.begin(), d.file.surfaces.end(),
                                    [](const SurfaceSource& s) { return !s.mesh.empty(); });
    if (others || d.scene.stereo)
        return;
    const Grid grid = drawn_grid(d);
    std::vector<HalfSpace> both = half_spaces(grid);
    const std::vector<HalfSpace> seen = seen_by(d.scene.camera, d.scene.size_px);
    both.insert(both.end(), seen.begin(), seen.end());
    if (!have_common_point(both, slack_mm(grid)))
        out.push_back(fmt::format("the camera sees nothing of the volume, within {} (LPS)",
                                  text_of(world_box(grid))));
}

bool is_see_through(const SurfaceLayer& layer) {
    const auto part = [](const SurfaceStyle& s) { return s.opacity > 0.0 && s.opacity < 1.0; };
    return part(layer.style) ||
           std::any_of(layer.label_styles.begin(), layer.label_styles.end(), part);
}

// Why --labels changes nothing; empty where it does.
std::string why_labels_are_idle(const SceneToDraw& d) {
    const Scene& scene = d.scene;
    const bool as_mesh = std::any_of(d.file.surfaces.begin(), d.file.surfaces.end(),
                                     [](const SurfaceSource& s) { return s.labels; });
    const bool hidden =
        scene.labels && std::any_of(scene.labels->styles.begin(), scene.labels->styles.end(),
                                    [](const LabelStyle& s) { return !s.visible; });
    if (as_mesh || hidden || !scene.slices.empty())
        return "";
    if (!scene.ray_cast)
        return fmt::format("without ray casting, slices and {} labels", Option{"surface"});
    return scene.ray_cast->mode == RayMode::mip ? "mode mip has no colours of labels" : "";
}

} // namespace

std::vector<std::string> empty_parts(const SceneToDraw& drawn) {
    Sentences out;
    if (drawn.loaded.data.volume.range().empty())
        out.push_back("the volume has no data: every sample is NaN or infinite");
    else
        for (const auto add :
             {add_isos, add_slices, add_clips, add_labels, add_transfer, add_camera})
            add(drawn, out);
    return out;
}

void warn_of_idle_options(const CLI::App& app, const SceneToDraw& d, const std::string& output,
                          uint32_t frames) {
    const Scene& scene = d.scene;
    const bool is_exr = std::filesystem::path(output).extension() == ".exr";
    const bool rays = scene.ray_cast.has_value(), slices = !scene.slices.empty(),
               meshes = !scene.surfaces.empty();
    const RayCastLayer layer = scene.ray_cast.value_or(RayCastLayer{});
    const bool alpha = rays && layer.mode == RayMode::alpha,
               mip = rays && layer.mode == RayMode::mip, iso = rays && layer.mode == RayMode::iso;
    const bool exact = rays && layer.integrator == Integrator::exact;
    const bool slab = std::any_of(scene.slices.begin(), scene.slices.end(),
                                  [](const SliceLayer& s) { return s.slab_mm > 0.0; });
    const bool see_through =
        std::any_of(scene.surfaces.begin(), scene.surfaces.end(), is_see_through);
    const std::string labels = why_labels_are_idle(d);
    const auto without = [](const char* option) {
        return fmt::format("without {}", Option{option});
    };
    const IdleOptions idle[] = {
        {!is_exr, {"--half", "--values"}, "of .exr alone"},
        {!output.ends_with(".png"), {"--dpi"}, "of .png alone"},
        {is_exr && alpha && !slices && !meshes, {"--values"}, "mode alpha has none"},
        {!labels.empty(), {"--labels"}, labels},
        {!rays,
         {"--integrator", "--step", "--sub-steps", "--jitter", "--min-transmittance", "--shade",
          "--no-shade", "--light", "--ambient-occlusion", "--no-skipping"},
         fmt::format("without ray casting, {} or {}", Option{"mode"}, Option{"iso"})},
        {exact, {"--step", "--jitter"}, "of fast and preintegrated"},
        {rays && !(exact && alpha),
         {"--sub-steps"},
         fmt::format("of mode alpha with {} exact", Option{"integrator"})},
        {(mip || iso) && layer.integrator == Integrator::preintegrated,
         {"--integrator"},
         "preintegrated is of mode alpha"},
        {mip, {"--min-transmittance"}, "mode mip looks along the whole ray"},
        {mip || iso, {"--shade", "--no-shade"}, "of mode alpha; iso is always shaded, mip never"},
        {mip || (alpha && !layer.shading), {"--light"}, "nothing is shaded"},
        {alpha || mip, {"--ambient-occlusion"}, "of mode iso"},
        {alpha || mip, {"--iso"}, "of mode iso"},
        {!slices && iso,
         {"--tf", "--window", "--window-level", "--window-preset"},
         "iso-surfaces have own colours"},
        {!slices && !rays,
         {"--tf", "--window", "--window-level", "--window-preset"},
         "of ray casting and slices"},
        {!slices,
         {"--slab", "--slab-mode", "--interpolation", "--fused", "--overlay"},
         without("slice")},
        {slices && !slab, {"--slab-mode"}, without("slab")},
        {!rays && !meshes, {"--clip"}, "slices are not cut"},
        {!meshes, {"--surface-depth"}, "without surfaces"},
        {meshes && !see_through, {"--surface-depth"}, "without see-through surfaces"},
        {!d.options.camera.empty(), {"--view", "--fill"}, fmt::format("with {}", Option{"camera"})},
        {d.options.camera.empty() && !fill_counts(d.options, d.file, scene),
         {"--fill"},
         without("view")},
        {scene.camera.projection == Projection::orthographic,
         {"--view-angle"},
         fmt::format("of {} perspective", Option{"projection"})},
        {!scene.stereo, {"--eye-separation", "--convergence", "--swap-eyes"}, without("stereo")},
        {frames == 1, {"--orbit-deg"}, "with one frame"},
        {app.count("--annotate") == 0, {"--text-size"}, without("annotate")},
        {!output.ends_with(".mp4"), {"--fps"}, "of .mp4"},
        {!alpha || !layer.shading, {"--gradients"}, "of shaded mode alpha"},
        {!rays && !slices,
         {"--residency", "--sampling", "--volume-format"},
         "meshes alone need no volume on the device"},
        {is_synthetic(d.file.volume), {"--frame", "--series"}, "of files"}};
    warn_of_idle(app, idle);
}

bool is_one_color(const std::vector<Image>& eyes) {
    for (const Image& eye : eyes)
        for (uint32_t y = 0; y < eye.size_px.y; ++y)
            for (uint32_t x = 0; x < eye.size_px.x; ++x)
                for (size_t c = 0; c < 3; ++c)
                    if (eye.at(x, y, c) != eyes.front().at(0, 0, c))
                        return false;
    return true;
}

} // namespace palpate
