// The outline of the scissors over a view.

#include "apps/view/drawing/mark_drawing.h"
#include "apps/view/tools/scissors_tool.h"

namespace palpate::view {

void draw_scissors(ImDrawList& list, const ViewState& state, Work&, Panel panel, const Box& box) {
    const Cutting& cutting = state.own.of<Cutting>();
    if (state.tool != &kScissorsTool || cutting.drawn_px.empty() || !state.drag ||
        state.drag->panel != panel)
        return;
    const glm::dvec2 low(box.low_px), high = low + glm::dvec2(box.size_px);
    list.PushClipRect(to_im(low), to_im(high), true);
    std::vector<ImVec2> points;
    for (const glm::dvec2 at : cutting.drawn_px)
        points.push_back(to_im(at + 0.5));
    const auto width = static_cast<float>(1.5 * state.text_scale);
    const auto count = static_cast<int>(points.size());
    list.AddPolyline(points.data(), count, kMarkShadow, 0, 2.0f * width);
    list.AddLine(points.back(), points.front(), kMarkShadow, 2.0f * width);
    list.AddPolyline(points.data(), count, kMarkTool, 0, width);
    list.AddLine(points.back(), points.front(), kMarkChosen,
                 width); // that closes it
    list.PopClipRect();
}

} // namespace palpate::view
