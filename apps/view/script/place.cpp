#include "apps/view/script/place.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/view/window/state.h"

namespace palpate::view {

namespace {

// The parts of a pixel that window systems tell (Wayland 1/256, X11 whole ones), and the error of
// the arithmetic: 1e5 px in double, three times transformed, is far below it.
constexpr double kParts = 256.0, kRounding_px = 1e-6;

glm::dvec2 whole_part(glm::dvec2 px) {
    const glm::dvec2 nearest = glm::round(px * kParts) / kParts;
    return {std::abs(nearest.x - px.x) < kRounding_px ? nearest.x : px.x,
            std::abs(nearest.y - px.y) < kRounding_px ? nearest.y : px.y};
}

glm::dvec2 at_share(const Box& box, glm::dvec2 share) {
    return glm::dvec2(box.low_px) + share * glm::dvec2(box.size_px);
}

glm::dvec2 share_of(const Box& box, glm::dvec2 px) {
    return (px - glm::dvec2(box.low_px)) / glm::dvec2(box.size_px);
}

bool has_room(const Box& box) {
    return box.size_px.x > 0 && box.size_px.y > 0;
}

std::optional<Box> box_of(const Shown& shown, const std::string& widget) {
    const auto found = shown.widgets->find(widget);
    return found != shown.widgets->end() && has_room(found->second) ? std::optional(found->second)
                                                                    : std::nullopt;
}

Place at_pixel(Panel panel, const Box& box, glm::dvec2 px, const Shown& shown) {
    if (is_slice(panel))
        return PointPlace{panel, point_under(*shown.state, *shown.grid, panel, px)};
    return ViewPlace{panel, share_of(box, px)};
}

// The same, at another pixel. None where what it names is gone.
Place moved(const Place& place, glm::dvec2 px, const Shown& shown) {
    if (const auto* widget = std::get_if<WidgetPlace>(&place)) {
        const std::optional<Box> box = box_of(shown, widget->id);
        return box ? Place(WidgetPlace{widget->id, share_of(*box, px)}) : Place();
    }
    const auto* in_view = std::get_if<ViewPlace>(&place);
    const auto* at_point = std::get_if<PointPlace>(&place);
    if (!in_view && !at_point)
        return {};
    const Panel panel = in_view ? in_view->panel : at_point->panel;
    const std::optional<Box> box = box_of(*shown.state, panel);
    return box && has_room(*box) ? at_pixel(panel, *box, px, shown) : Place();
}

} // namespace

std::optional<glm::dvec2> pixel_of(const Place& place, const Shown& shown) {
    std::optional<glm::dvec2> px;
    if (const auto* widget = std::get_if<WidgetPlace>(&place)) {
        if (const std::optional<Box> box = box_of(shown, widget->id))
            px = at_share(*box, widget->share);
    } else if (const auto* in_view = std::get_if<ViewPlace>(&place)) {
        if (const std::optional<Box> box = box_of(*shown.state, in_view->panel))
            px = at_share(*box, in_view->share);
    } else if (const auto* at = std::get_if<PointPlace>(&place)) {
        const glm::dvec3 point_mm = at->is_sample ? world_point(*shown.grid, at->point) : at->point;
        px = pixel_of(*shown.state, *shown.grid, at->panel, point_mm);
    }
    if (!px || !std::isfinite(px->x) || !std::isfinite(px->y))
        return std::nullopt;
    return whole_part(*px);
}

bool is_scrolled_away(const Place& place, glm::dvec2 px, const Shown& shown) {
    const auto* widget = std::get_if<WidgetPlace>(&place);
    // A share beyond the widget's edges is of something that lies beside it.
    if (!widget || !shown.seen || glm::any(glm::lessThan(widget->share, glm::dvec2(0.0))) ||
        glm::any(glm::greaterThanEqual(widget->share, glm::dvec2(1.0))))
        return false;
    const auto seen = shown.seen->find(widget->id);
    return seen != shown.seen->end() && !seen->second.holds(px);
}

std::string name_of(const Place& place) {
    if (const auto* widget = std::get_if<WidgetPlace>(&place))
        return fmt::format("widget '{}'", widget->id);
    if (const auto* in_view = std::get_if<ViewPlace>(&place))
        return fmt::format("view '{}'", name_of(in_view->panel));
    if (const auto* at = std::get_if<PointPlace>(&place))
        return fmt::format("point in view '{}'", name_of(at->panel));
    return "pixel";
}

Place Placing::place_of(const Event& event, const Shown& shown) {
    if (event.kind == Event::Kind::button)
        held_ = std::max(0, held_ + (event.down ? 1 : -1));
    if (event.kind != Event::Kind::move)
        return {};
    if (held_ > 0)
        return last_ = moved(last_, event.at_px, shown);
    last_ = {};
    std::optional<int> least; // a list may hold other widgets; dialogs lie over views
    for (const auto& [id, box] : *shown.widgets) {
        const int area = box.size_px.x * box.size_px.y;
        const WidgetPlace here{id, share_of(box, event.at_px)};
        if (has_room(box) && box.holds(event.at_px) && (!least || area < *least) &&
            !is_scrolled_away(here, event.at_px, shown)) {
            least = area;
            last_ = here;
        }
    }
    if (least)
        return last_;
    for (const Places::View& view : places_of(*shown.state).views)
        if (view.box.holds(event.at_px))
            last_ = at_pixel(view.panel, view.box, event.at_px, shown);
    return last_;
}

} // namespace palpate::view
