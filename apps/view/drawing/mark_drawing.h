#pragma once

#include <imgui/imgui.h>

#include <glm/glm.hpp>

// Colours and shapes that marks over the views are drawn with.
namespace palpate::view {

inline ImVec2 to_im(glm::dvec2 v) {
    return {static_cast<float>(v.x), static_cast<float>(v.y)};
}

constexpr ImU32 kMarkShadow = IM_COL32(0, 0, 0, 190), kMarkChosen = IM_COL32(110, 235, 255, 255),
                kMarkTool = IM_COL32(90, 220, 255, 255), kPlane = IM_COL32(225, 120, 235, 255);

// A circle about a place in pixels. Nothing where it is far larger than any window, as where a
// point beside the eye is projected: Dear ImGui looks up a radius in a table, as an int.
inline void draw_circle(ImDrawList& list, glm::dvec2 at_px, double radius_px, ImU32 color,
                        float width) {
    constexpr double kMost_px = 1e5;
    if (radius_px > 0.0 && radius_px < kMost_px)
        list.AddCircle(to_im(at_px), static_cast<float>(radius_px), color, 0, width);
}

} // namespace palpate::view
