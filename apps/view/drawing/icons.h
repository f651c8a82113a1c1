#pragma once

#include <cstdint>

namespace palpate::view {

// The icons of the window: codes of glyphs of Material Design Icons (drawing/letters.h).
enum class Icon : uint16_t {
    none = 0,
    auto_fix = 0xF068,
    brush = 0xF0E3,
    camera = 0xF100,
    crosshair = 0xF1A4,
    cut = 0xF190,
    down = 0xF140,
    eraser = 0xF1FE,
    eye = 0xF208,
    eye_off = 0xF209,
    eyedropper = 0xF20A,
    left = 0xF141,
    lock = 0xF33E,
    lock_open = 0xF33F,
    polyline = 0xF561,
    redo = 0xF44F,
    right = 0xF142,
    ruler = 0xF46D,
    save = 0xF193,
    target = 0xF4FE,
    undo = 0xF54D,
    vector_circle = 0xF556,
    vector_curve = 0xF559,
};
// All but none.
constexpr Icon kIcons[] = {
    Icon::auto_fix,  Icon::vector_circle, Icon::vector_curve, Icon::brush,  Icon::camera,
    Icon::crosshair, Icon::cut,           Icon::down,         Icon::eraser, Icon::eye,
    Icon::eye_off,   Icon::eyedropper,    Icon::left,         Icon::lock,   Icon::lock_open,
    Icon::polyline,  Icon::redo,          Icon::right,        Icon::ruler,  Icon::save,
    Icon::target,    Icon::undo};

} // namespace palpate::view
