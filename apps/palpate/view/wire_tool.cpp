#include "apps/palpate/view/wire_tool.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

namespace palpate::view {

namespace {

constexpr double kFirst_px = 8.0; // how near to the first sample a click closes the contour

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

void close(Outcome& next, const Event& event, const Subject& subject) {
    Wiring& wiring = next.state.wiring;
    const std::vector<glm::uvec3> back =
        path(subject, wiring.frozen.back(), wiring.frozen.front(), wiring.axis);
    freeze(wiring, back);
    wiring.frozen.pop_back(); // the first again
    wiring.closed = std::move(wiring.frozen);
    wiring.frozen.clear();
    next.orders.push_back({Order::Kind::fill_wire, {}, event.time_s, {}});
}

void tell(Outcome& next, const Event& event, const char* text) {
    next.orders.push_back({Order::Kind::tell, {}, event.time_s, text});
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
    const Wiring& wiring = state.wiring;
    if (!is_slice(panel) || wiring.frozen.empty() ||
        axis_across(grid, state.slices[static_cast<size_t>(panel)]) != wiring.axis)
        return false;
    const std::optional<glm::uvec3> here = sample_at(grid, state.crosshair_mm);
    return here && (*here)[wiring.axis] == wiring.frozen.front()[wiring.axis];
}

void press_wire(Outcome& next, const Event& event, const Subject& subject, Panel panel,
                bool twice) {
    ViewState& state = next.state;
    Wiring& wiring = state.wiring;
    const std::optional<glm::uvec3> at = sample_under(state, subject.grid, panel);
    if (wiring.frozen.empty()) {
        const auto axis = axis_across(subject.grid, state.slices[static_cast<size_t>(panel)]);
        if (!axis)
            tell(next, event, "live-wire needs a slice along the samples: R turns planes back");
        else if (at && !twice)
            wiring = {*axis, {*at}, {}, {}};
        return;
    }
    if (!shows_wire(state, subject.grid, panel))
        return tell(next, event, "the contour lies in another slice: Esc drops it");
    if (!at)
        return;
    const auto first = pixel_of(state, subject.grid, panel,
                                world_point(subject.grid, glm::dvec3(wiring.frozen.front())));
    const bool ends = twice || (first && glm::distance(*first, state.pointer_px) <= kFirst_px);
    if (ends && wiring.frozen.size() >= kFewest)
        return close(next, event, subject);
    if (!twice)
        freeze(wiring, path(subject, wiring.frozen.back(), *at, wiring.axis));
}

void follow_wire(ViewState& state, const Subject& subject) {
    Wiring& wiring = state.wiring;
    if (state.hand != Hand::wire || wiring.frozen.empty())
        return;
    wiring.live.clear();
    if (!state.under || !shows_wire(state, subject.grid, *state.under))
        return;
    if (const auto at = sample_under(state, subject.grid, *state.under))
        wiring.live = path(subject, wiring.frozen.back(), *at, wiring.axis);
}

bool cancel_wire(ViewState& state) {
    const bool begun = !state.wiring.frozen.empty();
    state.wiring.frozen.clear();
    state.wiring.live.clear();
    return begun;
}

bool press_wire_key(Outcome& next, const Event& event, const Subject& subject) {
    if (event.key == "u") {
        next.state.hand = Hand::wire;
        return true;
    }
    if (event.key != "enter" || next.state.hand != Hand::wire ||
        next.state.wiring.frozen.size() < kFewest)
        return false;
    close(next, event, subject);
    return true;
}

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
