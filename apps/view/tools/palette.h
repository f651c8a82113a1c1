#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/view/window/state.h"
#include "haptics/field/touch_plates.h"

namespace palpate::view {

// Widgets in the 3D view that a hand presses: buttons for what its button 0 does and for undo, a
// slider for the radius and a list of the tool's shapes. They face the eye in a column at the left,
// as far away as the camera's target, and so are of one size on the screen. Each clip plane has a
// handle at its point, on either side: pressed, it moves the plane along its normal.
struct Widget3d {
    enum class Kind { button, slider, list, plane };
    std::string id; // "cut"; as texts and tests name it
    Kind kind = Kind::button;
    haptics::TouchPlate plate;
    double value = 0.0;              // slider: 0 .. 1; button: 1 where it is chosen; list: the row
    std::vector<std::string> rows{}; // list: from the top
    size_t number = 0;               // plane: of the clip planes

    friend bool operator==(const Widget3d&, const Widget3d&) = default;
};
std::vector<Widget3d> palette_of(const ViewState& state); // empty where it is not shown

// How deep a plate is pressed for its widget to act, and to be let go; as shares of its travel.
constexpr double kPressed = 0.6, kReleased = 0.3;

// The widget that a ray meets, and where.
struct WidgetMet {
    size_t number;
    glm::dvec3 at_mm;
};
std::optional<WidgetMet> widget_met(const std::vector<Widget3d>& palette, const Ray& ray);

// Changes the state by a pressed widget. touched: where, and how deep. True: undo is asked for.
bool press_widget(ViewState& state, const Widget3d& widget, const haptics::PlateTouch& touched);
// Whether it goes on to act as long as it is pressed.
constexpr bool is_dragged(Widget3d::Kind kind) {
    return kind == Widget3d::Kind::slider || kind == Widget3d::Kind::plane;
}

// Boxes with the number of their widget, from 1 on, as labels; `pressed` lies lower. Their styles.
Mesh palette_mesh(const std::vector<Widget3d>& palette, const haptics::PlateTouch& pressed);
SurfaceLayer palette_layer(const std::vector<Widget3d>& palette,
                           const haptics::PlateTouch& pressed);

} // namespace palpate::view
