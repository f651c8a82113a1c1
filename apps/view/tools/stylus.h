#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <iterator>
#include <optional>

#include "engine/base/tool_pose.h"
#include "engine/edit/operation.h"

namespace palpate::view {

// The action of a button of the hand, with its tool.
enum class Carve {
    nothing,
    draw,
    erase,
    erode,
    dilate,
    smooth,
    cut,
    drill,
    add,
    seed,
    pull,
    crosshair
};
struct CarveRow {
    Carve carve;
    const char* name;
    std::optional<OperationKind> stroke{}; // that the editor makes of it; none: it is no stroke
    bool on_labels = false;                // and not on grey values or seeds
    bool in_palette = false;               // has a button among the widgets in 3D
};
// All of them, in the order of the enum.
inline constexpr CarveRow kCarveTable[] = {
    {Carve::nothing, "nothing", {}, false, true},
    {Carve::draw, "draw", OperationKind::draw, true, true},
    {Carve::erase, "erase", OperationKind::erase, true, true},
    {Carve::erode, "erode", OperationKind::erode, true},
    {Carve::dilate, "dilate", OperationKind::dilate, true},
    {Carve::smooth, "smooth", OperationKind::smooth, true},
    {Carve::cut, "cut", OperationKind::cut, false, true},
    {Carve::drill, "drill", OperationKind::mill, false, true},
    {Carve::add, "add", OperationKind::mill},
    {Carve::seed, "seed", OperationKind::draw}, // with the brush of the segmentation
    {Carve::pull, "pull"},                      // the mesh of a label
    {Carve::crosshair, "crosshair"},            // goes where the tool is
};
inline constexpr auto kCarves = [] {
    std::array<Carve, std::size(kCarveTable)> all{};
    for (size_t i = 0; i < all.size(); ++i)
        all[i] = kCarveTable[i].carve;
    return all;
}();
constexpr const CarveRow& row_of(Carve carve) {
    return kCarveTable[static_cast<size_t>(carve)];
}
constexpr const char* name_of(Carve carve) {
    return row_of(carve).name;
}
constexpr bool mills(Carve carve) {
    return row_of(carve).stroke == OperationKind::mill;
}

enum class TipShape { ball, box, cylinder, burr };
constexpr TipShape kTipShapes[] = {TipShape::ball, TipShape::box, TipShape::cylinder,
                                   TipShape::burr};
const char* name_of(TipShape shape);

// A hand in the window, on a haptic device or on the mouse: its tool, and where a pointer that is
// the hand wants it. The radius of the tool and the label that it draws are those of the view.
struct Stylus {
    bool on = false;                                       // a device runs
    bool by_pointer = false;                               // and the pointer moves it
    Carve first = Carve::nothing, second = Carve::nothing; // of its buttons 0 and 1
    TipShape shape = TipShape::ball;
    double rate_per_s = 5.0;  // of drill and add: the range of the grey values, so often a second
    bool arrow_shown = false; // the force
    bool sound_on = true, dust_shown = true; // of material that is removed

    // The pose that a pointer means. In slices it is on the plane. In 3D it is on a plane across
    // the view: depth_mm from the eye along the view, or where on_surface as deep as what is seen
    // under the pointer, and push_mm deeper.
    ToolPose meant;
    glm::dvec3 eye_mm{0.0}; // haptics::PointerTarget
    double clear_mm = 0.0;
    double depth_mm = 0.0; // 0: not known yet
    double push_mm = 0.0;
    bool on_surface = true;
    uint32_t buttons = 0;        // that are pressed
    bool presses_widget = false; // the left button does, over a widget in 3D

    bool can(Carve carve) const { return on && (first == carve || second == carve); }

    friend bool operator==(const Stylus&, const Stylus&) = default;
};

} // namespace palpate::view
