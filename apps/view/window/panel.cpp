#include "apps/view/window/panel.h"

#include <algorithm>
#include <cmath>

namespace palpate::view {

const char* name_of(Panel panel) {
    constexpr const char* names[] = {"axial", "coronal", "sagittal", "3d"};
    return names[static_cast<size_t>(panel)];
}

const char* title_of(Panel panel) {
    constexpr const char* titles[] = {"Axial", "Coronal", "Sagittal", "3D"};
    return titles[static_cast<size_t>(panel)];
}

const char* name_of(Layout layout) {
    constexpr const char* names[] = {"four", "3d", "slice"};
    return names[static_cast<size_t>(layout)];
}

namespace {

int scaled(double px, double text_scale) {
    return static_cast<int>(std::lround(px * text_scale));
}

// Small windows with large letters have narrow bars.
int tool_bar_px(glm::uvec2 window_px, double text_scale) {
    return std::min(scaled(44, text_scale), static_cast<int>(window_px.x / 10));
}

int top_bar_px(glm::uvec2 window_px, double text_scale) {
    return std::min(scaled(38, text_scale), static_cast<int>(window_px.y / 8));
}

} // namespace

glm::uvec2 bars_px(glm::uvec2 window_px, double text_scale) {
    return glm::uvec2(tool_bar_px(window_px, text_scale), top_bar_px(window_px, text_scale)) +
           2u * kGap_px;
}

Places places_of(glm::uvec2 window_px, Layout layout, Panel slice, std::optional<Panel> alone,
                 OpenPanels open, double text_scale) {
    const glm::ivec2 window(window_px);
    const glm::ivec2 bars(open.bars ? bars_px(window_px, text_scale) : glm::uvec2(0));
    const int gap = open.bars ? kGap_px : 0, bar = bars.x - 2 * gap, top = bars.y - 2 * gap;
    const glm::ivec2 inner = window - bars; // room of views and panels
    Places places;
    const int status = std::min(scaled(22, text_scale), inner.y / 4);
    const double panel_px = std::clamp(open.panel_px, kNarrowestPanel_px, kWidestPanel_px);
    const int width = std::min(scaled(panel_px, text_scale), inner.x / 2);
    const int foot = window.y - status, height = foot - top; // of panels
    places.status = {{0, foot}, {window.x, status}};
    places.top = {{0, 0}, {open.bars ? window.x : 0, top}};
    places.bar = {{0, top}, {bar, open.bars ? height : 0}};
    const bool is_stacked = open.tools && open.touch && inner.x - 2 * width < inner.x / 2;
    const int tools_height = is_stacked ? height / 2 : height;
    const int tools = open.tools ? width : 0;
    const int pressed = std::min(scaled(open.foot_px, text_scale), tools_height / 4);
    places.tools = {{window.x - tools, top}, {tools, tools_height - pressed}};
    places.foot = {{window.x - tools, top + tools_height - pressed}, {tools, pressed}};
    const int beside = open.touch && !is_stacked ? width : 0; // of the panel of touch
    if (is_stacked)
        places.touch = {{window.x - width, top + tools_height}, {width, height - tools_height}};
    else
        places.touch = {{window.x - tools - beside, top}, {beside, height}};
    const glm::ivec2 origin(bar + gap, top + gap);
    const glm::ivec2 room(inner.x - tools - beside, inner.y - status);
    if (alone || layout != Layout::four) {
        const Panel only = alone ? *alone : layout == Layout::volume ? Panel::volume : slice;
        places.views = {{only, {origin, room}}};
        return places;
    }
    const glm::ivec2 first = (room - kGap_px) / 2, second = room - kGap_px - first;
    const glm::ivec2 at = origin + first + kGap_px;
    places.views = {{Panel::axial, {origin, first}},
                    {Panel::volume, {{at.x, origin.y}, {second.x, first.y}}},
                    {Panel::coronal, {{origin.x, at.y}, {first.x, second.y}}},
                    {Panel::sagittal, {at, second}}};
    return places;
}

} // namespace palpate::view
