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

Places places_of(glm::uvec2 window_px, Layout layout, Panel slice, std::optional<Panel> alone,
                 OpenPanels open, double text_scale) {
    const glm::ivec2 window(window_px);
    const auto scaled = [&](double px) { return static_cast<int>(std::lround(px * text_scale)); };
    Places places;
    const int status = std::min(scaled(22), window.y / 4);
    const int width = std::min(scaled(264), window.x / 2); // of a panel
    const int height = window.y - status;
    places.status = {{0, height}, {window.x, status}};
    const bool is_stacked = open.tools && open.touch && window.x - 2 * width < window.x / 2;
    const int tools_height = is_stacked ? height / 2 : height;
    const int tools = open.tools ? width : 0;
    places.tools = {{window.x - tools, 0}, {tools, tools_height}};
    const int beside = open.touch && !is_stacked ? width : 0; // of the panel of touch
    if (is_stacked)
        places.touch = {{window.x - width, tools_height}, {width, height - tools_height}};
    else
        places.touch = {{window.x - tools - beside, 0}, {beside, height}};
    const glm::ivec2 room(window.x - tools - beside, height);
    if (alone || layout != Layout::four) {
        const Panel only = alone ? *alone : layout == Layout::volume ? Panel::volume : slice;
        places.views = {{only, {{0, 0}, room}}};
        return places;
    }
    const glm::ivec2 first = (room - kGap_px) / 2, second = room - kGap_px - first;
    const glm::ivec2 at = first + kGap_px;
    places.views = {{Panel::axial, {{0, 0}, first}},
                    {Panel::volume, {{at.x, 0}, {second.x, first.y}}},
                    {Panel::coronal, {{0, at.y}, {first.x, second.y}}},
                    {Panel::sagittal, {at, second}}};
    return places;
}

} // namespace palpate::view
