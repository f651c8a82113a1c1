// The tools that draw strokes with a round brush.

#include "apps/view/tools/tool.h"

namespace palpate::view {

// Tools on labels alone: one layer of a slice is what a person sees of them.
static bool can_be_disc(const Tool& tool) {
    return &tool == &kDrawTool || &tool == &kEraseTool;
}

static void take_brush(ViewState& state, bool again) {
    if (again)
        state.brush_is_disc = !state.brush_is_disc;
}

static std::string shape_of_brush(const ViewState& state) {
    return state.brush_is_disc ? "disc" : "ball";
}

std::optional<Drag::Kind> press_stroke(const ToolEvent& at) {
    if (!is_slice(at.panel))
        return std::nullopt;
    const ViewState& state = at.state();
    at.order(order::StrokeDown{at.point_mm(), at.event.time_s,
                               state.brush_is_disc && can_be_disc(*state.tool)
                                   ? state.slices[static_cast<size_t>(at.panel)].towards
                                   : glm::dvec3(0.0)});
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

// On labels: a ball, or a disc in the slice.
static constexpr Tool label_brush(Tool tool) {
    tool.take = take_brush;
    tool.kind = shape_of_brush;
    return tool;
}

constinit const Tool kDrawTool = label_brush(
    brush("draw", "draw", "b", "draws the label with a ball, or a disc in the slice, by turns",
          Icon::brush, Carve::draw, Carve::draw));
constinit const Tool kEraseTool = label_brush(
    brush("erase", "erase", "e", "sets labels to 0 in a ball, or a disc in the slice, by turns",
          Icon::eraser, Carve::erase, Carve::erase));
static void take_seeds(ViewState& state, bool again) {
    SeedBrush& seeds = state.segmenting.brush;
    if (again)
        seeds = seeds == SeedBrush::inside ? SeedBrush::outside : SeedBrush::inside;
}

static bool use_seed_key(Outcome& next, const Event& event, const Subject&) {
    if (event.key != "enter" || next.state.tool != &kSeedTool)
        return false;
    next.orders.push_back(order::Segment{});
    return true;
}

static std::string kind_of_seeds(const ViewState& state) {
    constexpr const char* kinds[] = {"inside", "outside", "erase"};
    return kinds[static_cast<size_t>(state.segmenting.brush)];
}

static constexpr Tool seed_brush(Tool tool) {
    tool.take = take_seeds;
    tool.use_key = use_seed_key;
    tool.kind = kind_of_seeds;
    return tool;
}

constinit const Tool kSeedTool = seed_brush(brush(
    "seed", "seeds", "q", "inside objects and outside, by turns; Enter: segment (task Segment)",
    Icon::target, Carve::seed, std::nullopt));
constinit const Tool kCutTool =
    brush("cut", "cut", "x", "cuts grey values away", Icon::cut, Carve::cut, Carve::cut);

} // namespace palpate::view
