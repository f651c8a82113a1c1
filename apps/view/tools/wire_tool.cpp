#include "apps/view/tools/wire_tool.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

namespace palpate::view {

namespace {

constexpr double kFirst_px = 8.0; // how near to the first sample a click closes the contour
constexpr double kTrace_px = 5.0; // a drag longer than this traces

// The sample under the pointer, in the slice that a panel shows.
std::optional<glm::uvec3> sample_under(const ViewState& state, const Grid& grid, Panel panel) {
    return sample_at(grid, point_under(state, grid, panel, state.pointer_px));
}

// From one sample to another, both included. Without somebody who knows costs: these two.
std::vector<glm::uvec3> path(const Subject& subject, glm::uvec3 from, glm::uvec3 to, int axis) {
    if (from == to)
        return {from};
    return subject.path ? subject.path(from, to, axis) : std::vector<glm::uvec3>{from, to};
}

void freeze(Wiring& wiring, const std::vector<glm::uvec3>& more) {
    wiring.frozen.insert(wiring.frozen.end(), more.begin() + 1, more.end());
    wiring.live.clear();
}

void close(Outcome& next, const Subject& subject) {
    Wiring& wiring = next.state.own.of<Wiring>();
    const std::vector<glm::uvec3> back =
        path(subject, wiring.frozen.back(), wiring.frozen.front(), wiring.axis);
    freeze(wiring, back);
    wiring.frozen.pop_back(); // the first again
    wiring.closed = std::move(wiring.frozen);
    wiring.frozen.clear();
    next.orders.push_back(order::FillWire{});
}

constexpr size_t kFewest = 3; // samples of a contour

} // namespace

std::optional<int> axis_across(const Grid& grid, const SliceView& slice) {
    const glm::dmat3 m(grid.world_from_index);
    for (int axis = 0; axis < 3; ++axis) {
        const glm::dvec3 normal = glm::normalize(glm::cross(m[(axis + 1) % 3], m[(axis + 2) % 3]));
        // The slice leaves the layer by less than a thousandth of a sample a thousand samples on.
        if (glm::length(glm::cross(normal, slice.towards)) < 1e-6)
            return axis;
    }
    return std::nullopt;
}

bool shows_wire(const ViewState& state, const Grid& grid, Panel panel) {
    const Wiring& wiring = state.own.of<Wiring>();
    if (!is_slice(panel) || wiring.frozen.empty() ||
        axis_across(grid, state.slices[static_cast<size_t>(panel)]) != wiring.axis)
        return false;
    const std::optional<glm::uvec3> here = sample_at(grid, state.crosshair_mm);
    return here && (*here)[wiring.axis] == wiring.frozen.front()[wiring.axis];
}

namespace {

void press_in_wire_slice(const ToolEvent& at) {
    ViewState& state = at.state();
    const Grid& grid = at.subject.grid;
    Wiring& wiring = state.own.of<Wiring>();
    const std::optional<glm::uvec3> sample = sample_under(state, grid, at.panel);
    if (wiring.frozen.empty()) {
        const auto axis = axis_across(grid, state.slices[static_cast<size_t>(at.panel)]);
        if (!axis)
            at.tell("live-wire needs a slice along the samples: R turns planes back");
        else if (sample && !at.twice)
            wiring = {*axis, {*sample}, {}, {}, /*begun_by_press=*/true};
        return;
    }
    if (!shows_wire(state, grid, at.panel))
        return at.tell("the contour lies in another slice: Esc drops it");
    if (!sample)
        return;
    const auto first =
        pixel_of(state, grid, at.panel, world_point(grid, glm::dvec3(wiring.frozen.front())));
    const bool ends = at.twice || (first && glm::distance(*first, state.pointer_px) <= kFirst_px);
    if (ends && wiring.frozen.size() >= kFewest)
        return close(at.next, at.subject);
    if (!at.twice)
        freeze(wiring, path(at.subject, wiring.frozen.back(), *sample, wiring.axis));
}

std::optional<Drag::Kind> press_wire(const ToolEvent& at) {
    if (!is_slice(at.panel))
        return std::nullopt;
    Wiring& wiring = at.state().own.of<Wiring>();
    wiring.begun_by_press = wiring.traced = false;
    press_in_wire_slice(at);
    return Drag::Kind::tool;
}

// Samples under the pointer, one after the other; between them the contour is straight.
void trace_wire(const ToolEvent& at) {
    ViewState& state = at.state();
    Wiring& wiring = state.own.of<Wiring>();
    if (wiring.frozen.empty() || !box_of(state, at.panel) ||
        !shows_wire(state, at.subject.grid, at.panel))
        return;
    wiring.traced = wiring.traced || glm::distance(state.pointer_px, state.pressed_px) > kTrace_px;
    const auto sample = sample_under(state, at.subject.grid, at.panel);
    if (wiring.traced && sample && *sample != wiring.frozen.back()) {
        wiring.frozen.push_back(*sample);
        wiring.live.clear();
    }
}

void end_trace(const ToolEvent& at) {
    Wiring& wiring = at.state().own.of<Wiring>();
    if (!std::exchange(wiring.traced, false) || !wiring.begun_by_press ||
        wiring.frozen.size() < kFewest)
        return;
    wiring.closed = std::exchange(wiring.frozen, {});
    wiring.live.clear();
    at.order(order::FillWire{});
}

// The path to the pointer.
void follow_wire(ViewState& state, const Subject& subject) {
    Wiring& wiring = state.own.of<Wiring>();
    if (wiring.frozen.empty())
        return;
    wiring.live.clear();
    if (!state.under || !shows_wire(state, subject.grid, *state.under))
        return;
    if (const auto at = sample_under(state, subject.grid, *state.under))
        wiring.live = path(subject, wiring.frozen.back(), *at, wiring.axis);
}

bool cancel_wire(ViewState& state) {
    Wiring& wiring = state.own.of<Wiring>();
    const bool begun = !wiring.frozen.empty();
    wiring.frozen.clear();
    wiring.live.clear();
    return begun;
}

bool use_wire_key(Outcome& next, const Event& event, const Subject& subject) {
    if (event.key != "enter" || next.state.tool != &kWireTool ||
        next.state.own.of<Wiring>().frozen.size() < kFewest)
        return false;
    close(next, subject);
    return true;
}

} // namespace

constinit const Tool kWireTool{
    .name = "wire",
    .title = "live-wire",
    .key = "u",
    .help =
        "a contour along edges; click: freeze; Enter, double click: fill; a drag traces and fills",
    .icon = Icon::polyline,
    .group = ToolGroup::paint,
    .press = press_wire,
    .drag = trace_wire,
    .release = end_trace,
    .abort = [](const ToolEvent& at) { cancel_wire(at.state()); },
    .hover = follow_wire,
    .cancel = cancel_wire,
    .use_key = use_wire_key,
    .marks = draw_wire,
};

std::vector<glm::uvec3> filled(std::span<const glm::uvec3> contour, int axis) {
    const int across = axis == 0 ? 1 : 0, down = axis == 2 ? 1 : 2;
    const auto key = [](glm::uvec3 p) { return std::array{p.z, p.y, p.x}; };
    std::set<std::array<uint32_t, 3>> found;
    uint32_t low = UINT32_MAX, high = 0;
    for (const glm::uvec3 p : contour) {
        found.insert(key(p));
        low = std::min(low, p[down]);
        high = std::max(high, p[down]);
    }
    for (uint32_t row = low; row <= high && !contour.empty(); ++row) {
        std::vector<double> crossings;
        for (size_t i = 0; i < contour.size(); ++i) {
            const glm::dvec3 a(contour[i]), b(contour[(i + 1) % contour.size()]);
            if ((a[down] <= row) != (b[down] <= row))
                crossings.push_back(a[across] + (row - a[down]) * (b[across] - a[across]) /
                                                    (b[down] - a[down]));
        }
        std::sort(crossings.begin(), crossings.end());
        for (size_t i = 0; i + 1 < crossings.size(); i += 2)
            for (double x = std::ceil(crossings[i]); x <= crossings[i + 1]; ++x) {
                glm::uvec3 p = contour.front();
                p[across] = static_cast<uint32_t>(x);
                p[down] = row;
                found.insert(key(p));
            }
    }
    std::vector<glm::uvec3> samples;
    for (const auto& [z, y, x] : found)
        samples.emplace_back(x, y, z);
    return samples;
}

} // namespace palpate::view
