#include "apps/view/tools/palette.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>

#include "haptics/core/workspace.h"

namespace palpate::view {

namespace {

// Shares of the height that the view has at the camera's target.
constexpr double kWidth = 0.15, kHeight = 0.055, kTravel = 0.02, kEvery = 0.075, kFromLeft = 0.06;
// The height of a row; the side of a handle.
constexpr double kListRow = 0.042, kHandle = 0.06;
const auto kCarveButtons = std::count_if(std::begin(kCarveTable), std::end(kCarveTable),
                                         [](const CarveRow& row) { return row.in_palette; });
constexpr double kLeast_mm = 0.5, kMost_mm = 20.0; // of the radius, on a logarithmic scale

void add_box(Mesh& mesh, glm::dvec3 low, glm::dvec3 high, uint16_t label) {
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    for (uint32_t corner = 0; corner < 8; ++corner)
        mesh.positions.emplace_back(corner & 1 ? high.x : low.x, corner & 2 ? high.y : low.y,
                                    corner & 4 ? high.z : low.z);
    constexpr uint32_t faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                      {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& face : faces)
        for (const uint32_t half : {1u, 2u}) {
            mesh.triangles.emplace_back(first + face[0], first + face[half],
                                        first + face[half + 1]);
            mesh.labels.push_back(label);
        }
}

// A turn whose z is a direction of unit length.
glm::dquat turn_to(glm::dvec3 z) {
    const glm::dvec3 other = std::abs(z.x) < 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 x = glm::normalize(glm::cross(other, z));
    return glm::normalize(glm::quat_cast(glm::dmat3(x, glm::cross(z, x), z)));
}

double slider_of(double radius_mm) {
    return std::clamp(std::log(radius_mm / kLeast_mm) / std::log(kMost_mm / kLeast_mm), 0.0, 1.0);
}

} // namespace

std::vector<Widget3d> palette_of(const ViewState& state) {
    std::vector<Widget3d> palette;
    if (!state.palette_shown)
        return palette;
    const glm::uvec2 size = volume_size_px(state);
    const View view = make_view(state.camera, size);
    const double distance_mm = glm::distance(state.camera.eye_mm, state.camera.target_mm);
    const bool flat = view.projection == Projection::orthographic;
    const double scale = flat ? 1.0 : distance_mm;
    const double height_mm = scale * (view.top - view.bottom);
    const double left_mm = scale * view.left;
    const glm::dquat turn = haptics::aligned_with_view(view.right, view.up);
    const auto put = [&](std::string id, Widget3d::Kind kind, double value, double up,
                         double height) {
        const glm::dvec2 at(left_mm + height_mm * (kFromLeft + 0.5 * kWidth), height_mm * up);
        palette.push_back(
            {std::move(id),
             kind,
             {.top = {state.camera.target_mm + at.x * view.right + at.y * view.up, turn},
              .half_mm = 0.5 * height_mm * glm::dvec2(kWidth, height),
              .travel_mm = height_mm * kTravel},
             value});
    };
    const auto row = [&] {
        return kEvery *
               (0.5 * static_cast<double>(kCarveButtons + 1) - static_cast<double>(palette.size()));
    };
    const auto add = [&](std::string id, Widget3d::Kind kind, double value) {
        put(std::move(id), kind, value, row(), kHeight);
    };
    for (const CarveRow& carve : kCarveTable)
        if (carve.in_palette)
            add(carve.name, Widget3d::Kind::button, state.stylus.first == carve.carve);
    add("undo", Widget3d::Kind::button, 0.0);
    add("radius", Widget3d::Kind::slider, slider_of(state.radius_mm));
    const double shapes = kListRow * std::size(kTipShapes);
    put("shape", Widget3d::Kind::list, static_cast<double>(state.stylus.shape),
        row() + 0.5 * (kEvery - shapes), shapes);
    for (const TipShape shape : kTipShapes)
        palette.back().rows.emplace_back(name_of(shape));
    const double aside_mm = -left_mm - height_mm * (kFromLeft + 0.5 * kWidth);
    for (size_t i = 0; i < state.notes.clip_planes.size(); ++i)
        for (const double side : {1.0, -1.0}) {
            const ClipPlane& plane = state.notes.clip_planes[i];
            const glm::dvec3 n = plane.normal, target = state.camera.target_mm;
            const auto within = [&](glm::dvec3 v) { return v - glm::dot(v, n) * n; };
            glm::dvec3 aside = within(view.right); // opposite of the column
            if (glm::length(aside) < 0.3)
                aside = within(view.up);
            const glm::dvec3 at =
                plane.point_mm + within(target - plane.point_mm) + aside_mm * glm::normalize(aside);
            palette.push_back({fmt::format("plane {}", i + 1),
                               Widget3d::Kind::plane,
                               {.top = {at, turn_to(side * n)},
                                .half_mm = glm::dvec2(0.5 * height_mm * kHandle),
                                .travel_mm = height_mm * kTravel},
                               0.0,
                               {},
                               i});
        }
    return palette;
}

std::optional<WidgetMet> widget_met(const std::vector<Widget3d>& palette, const Ray& ray) {
    for (size_t i = 0; i < palette.size(); ++i) {
        const haptics::TouchPlate& plate = palette[i].plate;
        const glm::dquat turn = glm::conjugate(plate.top.rotation);
        const glm::dvec3 from = turn * (ray.origin_mm - plate.top.position_mm),
                         along = turn * ray.direction;
        if (!(along.z < 0.0))
            continue;
        const double t = -from.z / along.z;
        const glm::dvec3 at = from + t * along;
        if (t > 0.0 && std::abs(at.x) <= plate.half_mm.x && std::abs(at.y) <= plate.half_mm.y)
            return WidgetMet{i, ray.origin_mm + t * ray.direction};
    }
    return std::nullopt;
}

bool press_widget(ViewState& state, const Widget3d& widget, const haptics::PlateTouch& touched) {
    if (widget.kind == Widget3d::Kind::slider) {
        const double half = widget.plate.half_mm.x;
        const double share = std::clamp(0.5 + 0.5 * touched.at_mm.x / half, 0.0, 1.0);
        state.radius_mm = kLeast_mm * std::pow(kMost_mm / kLeast_mm, share);
        return false;
    }
    if (widget.kind == Widget3d::Kind::list) {
        const double share =
            std::clamp(0.5 - 0.5 * touched.at_mm.y / widget.plate.half_mm.y, 0.0, 1.0 - 1e-9);
        state.stylus.shape = kTipShapes[static_cast<size_t>(share * std::size(kTipShapes))];
        return false;
    }
    if (widget.kind == Widget3d::Kind::plane) { // it goes on until it is pressed no deeper
        const double by_mm = touched.depth_mm - kPressed * widget.plate.travel_mm;
        if (by_mm > 0.0 && widget.number < state.notes.clip_planes.size())
            state.notes.clip_planes[widget.number].point_mm -=
                by_mm * (widget.plate.top.rotation * glm::dvec3(0.0, 0.0, 1.0));
        return false;
    }
    for (const CarveRow& carve : kCarveTable)
        if (carve.in_palette && widget.id == carve.name)
            state.stylus.first = carve.carve;
    return widget.id == "undo";
}

Mesh palette_mesh(const std::vector<Widget3d>& palette, const haptics::PlateTouch& pressed) {
    Mesh mesh;
    if (palette.empty())
        return mesh;
    const ToolPose& base = palette.front().plate.top;
    mesh.world_from_mesh =
        glm::translate(glm::dmat4(1.0), base.position_mm) * glm::mat4_cast(base.rotation);
    for (size_t i = 0; i < palette.size(); ++i) {
        if (palette[i].kind == Widget3d::Kind::plane) // its plane would cut it: drawn as a mark
            continue;
        const haptics::TouchPlate& plate = palette[i].plate;
        const glm::dvec3 at =
            glm::conjugate(base.rotation) * (plate.top.position_mm - base.position_mm);
        const double down = pressed.plate == static_cast<int32_t>(i)
                                ? std::min(pressed.depth_mm, plate.travel_mm)
                                : 0.0;
        const auto label = static_cast<uint16_t>(i + 1);
        const glm::dvec3 half(plate.half_mm, 0.0);
        add_box(mesh, at - half - glm::dvec3(0.0, 0.0, 1.5 * plate.travel_mm),
                at + half - glm::dvec3(0.0, 0.0, down), label);
        if (palette[i].kind == Widget3d::Kind::slider) { // its knob
            const double x = at.x + plate.half_mm.x * (2.0 * palette[i].value - 1.0);
            const double w = 0.04 * plate.half_mm.x, h = plate.half_mm.y;
            add_box(mesh, {x - w, at.y - h, at.z - down},
                    {x + w, at.y + h, at.z - down + 0.2 * plate.travel_mm},
                    static_cast<uint16_t>(palette.size() + 1));
        }
        if (palette[i].kind == Widget3d::Kind::list) { // its chosen row
            const double half_row = plate.half_mm.y / static_cast<double>(palette[i].rows.size());
            const double y = at.y + plate.half_mm.y - (2.0 * palette[i].value + 1.0) * half_row;
            add_box(mesh, {at.x - plate.half_mm.x, y - half_row, at.z - down},
                    {at.x + plate.half_mm.x, y + half_row, at.z - down + 0.1 * plate.travel_mm},
                    static_cast<uint16_t>(palette.size() + 2));
        }
    }
    return mesh;
}

SurfaceLayer palette_layer(const std::vector<Widget3d>& palette,
                           const haptics::PlateTouch& pressed) {
    constexpr glm::dvec3 plain(0.35, 0.38, 0.45), chosen(0.15, 0.5, 0.65), down(0.85, 0.5, 0.15),
        knob(0.85, 0.87, 0.9);
    SurfaceLayer layer;
    layer.smooth = false;
    layer.label_styles.push_back({}); // of label 0
    for (size_t i = 0; i < palette.size(); ++i) {
        const bool is_down = pressed.plate == static_cast<int32_t>(i) &&
                             pressed.depth_mm > kPressed * palette[i].plate.travel_mm;
        const bool is_chosen = palette[i].kind == Widget3d::Kind::button && palette[i].value > 0.5;
        layer.label_styles.push_back({.color = is_down ? down : is_chosen ? chosen : plain});
    }
    layer.label_styles.push_back({.color = knob});
    layer.label_styles.push_back({.color = chosen});
    return layer;
}

} // namespace palpate::view
