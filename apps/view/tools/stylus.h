#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "engine/base/tool_pose.h"

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
    seed,     // with the brush of the segmentation
    pull,     // the mesh of a label
    crosshair // goes where the tool is
};
constexpr Carve kCarves[] = {Carve::nothing, Carve::draw,   Carve::erase, Carve::erode,
                             Carve::dilate,  Carve::smooth, Carve::cut,   Carve::drill,
                             Carve::add,     Carve::seed,   Carve::pull,  Carve::crosshair};
const char* name_of(Carve carve);
constexpr bool is_stroke(Carve carve) { // of the editor
    return carve != Carve::nothing && carve != Carve::pull && carve != Carve::crosshair;
}
constexpr bool is_on_labels(Carve carve) {
    return carve >= Carve::draw && carve <= Carve::smooth;
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
