// The tools that draw strokes with a round brush.

#include "apps/view/tools/tool.h"

namespace palpate::view {

std::optional<Drag::Kind> press_stroke(const ToolEvent& at) {
    if (!is_slice(at.panel))
        return std::nullopt;
    at.order(order::StrokeDown{at.point_mm(), at.event.time_s});
    return Drag::Kind::tool;
}

void drag_stroke(const ToolEvent& at) {
    at.order(order::StrokeMove{at.point_mm(), at.event.time_s});
}

void end_stroke(const ToolEvent& at) {
    const ViewState& state = at.state();
    at.order(order::StrokeUp{
        box_of(state, at.panel) ? point_under(state, at.subject.grid, at.panel, state.drag->last_px)
                                : state.crosshair_mm, // the layout changed meanwhile
        at.event.time_s});
}

void abort_stroke(const ToolEvent& at) {
    at.order(order::StrokeCancel{at.event.time_s});
}

// `stroke`: what it does; `first_button`: Tool::first_button.
static constexpr Tool brush(const char* name, const char* title, const char* key, const char* help,
                            Icon icon, Carve stroke, std::optional<Carve> first_button) {
    return {.name = name,
            .title = title,
            .key = key,
            .help = help,
            .icon = icon,
            .group = ToolGroup::paint,
            .press = press_stroke,
            .drag = drag_stroke,
            .release = end_stroke,
            .abort = abort_stroke,
            .stroke = stroke,
            .first_button = first_button,
            .has_radius = true};
}

constinit const Tool kDrawTool =
    brush("draw", "draw", "b", "draws the label", Icon::brush, Carve::draw, Carve::draw);
constinit const Tool kEraseTool =
    brush("erase", "erase", "e", "sets labels to 0", Icon::eraser, Carve::erase, Carve::erase);
constinit const Tool kSeedTool =
    brush("seed", "seeds", "q", "where objects are, for a segmentation (task Segment)",
          Icon::target, Carve::seed, std::nullopt);
constinit const Tool kCutTool =
    brush("cut", "cut", "x", "cuts grey values away", Icon::cut, Carve::cut, Carve::cut);

} // namespace palpate::view
