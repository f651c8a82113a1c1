#include "apps/view/tools/pick_tool.h"

#include <algorithm>
#include <cmath>

namespace palpate::view {

namespace {

// The values that a drag has passed over.
struct Picking {
    double low = INFINITY, high = -INFINITY;

    friend bool operator==(const Picking&, const Picking&) = default;
};

bool pick_label(const ToolEvent& at, glm::dvec3 point_mm) {
    const uint16_t label = at.subject.label_at ? at.subject.label_at(point_mm) : uint16_t{0};
    if (label == 0)
        return false;
    at.state().label = label;
    at.tell(fmt::format("label {} is drawn now", label));
    return true;
}

// The values on the way of the pointer, pixel by pixel.
void pick_values(const ToolEvent& at, glm::dvec2 from_px) {
    const ViewState& state = at.state();
    Picking& picking = at.state().own.of<Picking>();
    const int steps = std::max(1, static_cast<int>(glm::distance(from_px, state.pointer_px)));
    for (int i = 0; i <= steps && at.subject.value_at; ++i) {
        const glm::dvec2 px = glm::mix(from_px, state.pointer_px, double(i) / steps);
        const auto value = at.subject.value_at(point_under(state, at.subject.grid, at.panel, px));
        picking.low = std::min(picking.low, value.value_or(INFINITY));
        picking.high = std::max(picking.high, value.value_or(-INFINITY));
    }
}

std::optional<Drag::Kind> press_pick(const ToolEvent& at) {
    if (!is_slice(at.panel))
        return std::nullopt;
    if (pick_label(at, at.point_mm()))
        return Drag::Kind::nothing;
    at.state().own.of<Picking>() = {};
    pick_values(at, at.state().pointer_px);
    return Drag::Kind::tool;
}

void drag_pick(const ToolEvent& at) {
    pick_values(at, at.state().drag->last_px);
}

void release_pick(const ToolEvent& at) {
    const auto [low, high] = at.state().own.of<Picking>();
    if (!(low < high))
        return at.tell("no label is here: a drag takes the range of its grey values");
    at.state().only_values = {low, high};
    at.tell(fmt::format("tools on labels change samples of {:g} .. {:g} alone (task Segment, Mask)",
                        low, high));
}

void click_pick(const ToolEvent& at) {
    const auto seen = at.subject.pick
                          ? at.subject.pick(ray_under(at.state(), at.state().pointer_px))
                          : std::nullopt;
    if (seen && !pick_label(at, *seen))
        at.tell("no label is here");
}

} // namespace

constinit const Tool kPickTool{
    .name = "pick",
    .title = "pick",
    .key = "z",
    .help = "the label under the pointer, or by a drag the grey values, for the brush",
    .icon = Icon::eyedropper,
    .press = press_pick,
    .drag = drag_pick,
    .release = release_pick,
    .click = click_pick,
};

} // namespace palpate::view
