#pragma once

#include <optional>
#include <span>
#include <string>
#include <utility>

#include "apps/view/drawing/icons.h"
#include "apps/view/window/interaction.h"

struct ImDrawList;

namespace palpate::view {

class Work;

// An event in a view, as a tool is told of it. The tool changes the state and adds orders.
struct ToolEvent {
    Outcome& next;
    const Event& event;
    const Subject& subject;
    Panel panel;        // that the button was pressed in
    bool twice = false; // the press is the second one of a double click

    ViewState& state() const { return next.state; }
    // The point under the pointer, in a slice.
    glm::dvec3 point_mm() const {
        return point_under(next.state, subject.grid, panel, next.state.pointer_px);
    }
    void order(Order order) const { next.orders.push_back(std::move(order)); }
    void tell(std::string words) const { order(order::Tell{std::move(words)}); }
};

enum class ToolGroup { point, paint, measure }; // of buttons on the tool bar, from above

// A tool of the left button, as one value of the table tools(). Keys, the tool bar and the help are
// made from the table (docs/recipes/tool.md). A function that a tool does not have is null. All but
// marks are pure, as after() is. What a tool has to remember is ViewState::own.of<Its type>().
struct Tool {
    const char* name;       // in states; its button has the id "tool/<name>"
    const char* title;      // null: it has no button on the tool bar
    const char* key;        // that takes it into the hand; null: none
    const char* help;       // one line
    Icon icon = Icon::none; // of its button; none: the first letters of the title
    ToolGroup group = ToolGroup::point;

    // A press. Nothing: the tool has no use for it, and the view takes it: in 3D it moves the
    // camera, in a slice the crosshair. Drag::Kind::tool: what follows is the tool's drag.
    // Drag::Kind::nothing: the press was all.
    std::optional<Drag::Kind> (*press)(const ToolEvent&) = nullptr;
    void (*drag)(const ToolEvent&) = nullptr;    // the pointer has moved
    void (*release)(const ToolEvent&) = nullptr; // the drag ends, wherever the pointer is
    void (*abort)(const ToolEvent&) = nullptr;   // Escape ends the drag
    // In 3D: the button was pressed and let go in one place, and press() had no use for it.
    void (*click)(const ToolEvent&) = nullptr;
    // The pointer has moved, and no button is pressed.
    void (*hover)(ViewState&, const Subject&) = nullptr;
    // Escape, and no button is pressed. False: nothing was begun.
    bool (*cancel)(ViewState&) = nullptr;
    // Another key, whichever tool is in the hand. False: it is not the tool's.
    bool (*use_key)(Outcome& next, const Event&, const Subject&) = nullptr;
    // Its key was pressed. `again`: it was in the hand already.
    void (*take)(ViewState&, bool again) = nullptr;

    // The change that strokes of the tool make to the volume or labels, if it has press_stroke().
    Carve stroke = Carve::nothing;
    // The action that its key gives to a haptic hand's first button; none: that keeps what it has.
    std::optional<Carve> first_button{};
    bool has_radius = false; // a circle about the pointer shows it

    // Over a view, whichever tool is in the hand.
    void (*marks)(ImDrawList&, const ViewState&, Work&, Panel, const Box&) = nullptr;
    // The text in the line at the bottom when the tool is taken, or this changes.
    std::string (*how_to)(const ViewState&) = nullptr;
    // One of several kinds, which stands beside the tool's button.
    std::string (*kind)(const ViewState&) = nullptr;
};

// All tools. Those of a group follow each other, in the order of the tool bar.
std::span<const Tool* const> tools();

std::string key_of(const Tool& tool); // "B", for help

// Gives the mouse a tool, and a hand's first button its action. A tool that has none is for the
// mouse alone: a hand that the mouse moves is put down for it.
void choose_tool(ViewState& state, const Tool& tool);
// The left button of the mouse does what this tool does.
bool is_in_hand(const ViewState& state, const Tool& tool);

// Takes the tool of a key into the hand. False: the key has none.
bool take_tool(ViewState& state, const std::string& key);

// Strokes of a round brush in slices: press, drag, release and abort of tools with Tool::stroke.
std::optional<Drag::Kind> press_stroke(const ToolEvent& at);
void drag_stroke(const ToolEvent& at);
void end_stroke(const ToolEvent& at);
void abort_stroke(const ToolEvent& at);

extern const Tool kDrawTool, kEraseTool, kSeedTool, kCutTool;

} // namespace palpate::view
