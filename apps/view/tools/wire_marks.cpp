// The contour of the live-wire tool over a slice.

#include "apps/view/drawing/mark_drawing.h"
#include "apps/view/panels/interface.h"
#include "apps/view/tools/wire_tool.h"

namespace palpate::view {

void draw_wire(ImDrawList& list, const ViewState& state, Work& work, Panel panel, const Box& box) {
    const Grid& grid = work.subject().grid;
    const Wiring& wiring = state.own.of<Wiring>();
    if (state.tool != &kWireTool || !shows_wire(state, grid, panel))
        return;
    const glm::dvec2 low(box.low_px), high = low + glm::dvec2(box.size_px);
    list.PushClipRect(to_im(low), to_im(high), true);
    const auto draw = [&](const std::vector<glm::uvec3>& samples, ImU32 color) {
        std::vector<ImVec2> points;
        for (const glm::uvec3 at : samples)
            points.push_back(to_im(
                pixel_of(state, grid, panel, world_point(grid, glm::dvec3(at))).value() + 0.5));
        const auto count = static_cast<int>(points.size());
        const auto width = static_cast<float>(1.5 * state.text_scale);
        list.AddPolyline(points.data(), count, kMarkShadow, 0, 2.0f * width);
        list.AddPolyline(points.data(), count, color, 0, width);
    };
    draw(wiring.frozen, kMarkTool);
    draw(wiring.live, kMarkChosen);
    const glm::dvec2 first =
        pixel_of(state, grid, panel, world_point(grid, glm::dvec3(wiring.frozen.front()))).value() +
        0.5;
    draw_circle(list, first, 4.0 * state.text_scale, kMarkTool, 1.5f);
    list.PopClipRect();
}

} // namespace palpate::view
