#pragma once

#include <glm/glm.hpp>
#include <map>
#include <optional>
#include <string>
#include <variant>

#include "apps/view/script/event.h"
#include "apps/view/window/panel.h"
#include "engine/volume/grid.h"

namespace palpate::view {

struct ViewState;

// Places of the pointer by what lies there, so that a script means the same in a window of another
// size, layout or size of letters. A share is of a box's width and height, from its upper left
// corner; it may lie outside 0 .. 1 while a button that was pressed in the box is held.
struct WidgetPlace {
    std::string id; // as of Interface::widgets(): "tool/draw"
    glm::dvec2 share{0.5};

    friend bool operator==(const WidgetPlace&, const WidgetPlace&) = default;
};
struct ViewPlace {
    Panel panel = Panel::volume;
    glm::dvec2 share{0.5};

    friend bool operator==(const ViewPlace&, const ViewPlace&) = default;
};
struct PointPlace { // where a point of the patient is seen
    Panel panel = Panel::axial;
    glm::dvec3 point{0.0};
    bool is_sample = false; // else mm

    friend bool operator==(const PointPlace&, const PointPlace&) = default;
};
// None: the pixel that the event names.
using Place = std::variant<std::monostate, WidgetPlace, ViewPlace, PointPlace>;

// The window as it was at the end of a frame.
struct Shown {
    const ViewState* state;
    const std::map<std::string, Box>* widgets;
    const Grid* grid;
    const std::map<std::string, Box>* seen = nullptr; // parts of widgets; null: all are seen
};

// The pixel of the window at a place; none where the widget or view is not shown, or a 3D view has
// the point behind its eye. A pixel that is written as a place and read again is the same bits if
// it is a multiple of 1/256, as those of window systems are.
std::optional<glm::dvec2> pixel_of(const Place& place, const Shown& shown);

// Whether a widget's place is scrolled out of its panel, so that a press there is for another one.
bool is_scrolled_away(const Place& place, glm::dvec2 px, const Shown& shown);

// The name of a place in messages: "widget 'tool/draw'".
std::string name_of(const Place& place);

// Names the places of moves as they happen. A button that is held keeps what it was pressed in.
class Placing {
 public:
    Place place_of(const Event& event, const Shown& shown);

 private:
    Place last_;
    int held_ = 0; // buttons
};

} // namespace palpate::view
