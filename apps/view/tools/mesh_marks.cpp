// The mesh that is pulled, where it cuts a slice.

#include "apps/view/drawing/mark_drawing.h"
#include "apps/view/panels/interface.h"
#include "apps/view/tools/mesh_tool.h"

namespace palpate::view {

void draw_mesh(ImDrawList& list, const ViewState& state, Work& work, Panel panel, const Box& box) {
    if (!(state.tool == &kPullTool || state.stylus.can(Carve::pull)) ||
        !work.mesh_pulling().mesh() || !is_slice(panel))
        return;
    const glm::dvec2 low(box.low_px), high = low + glm::dvec2(box.size_px);
    list.PushClipRect(to_im(low), to_im(high), true);
    const auto width = static_cast<float>(1.5 * state.text_scale);
    const Grid& grid = work.subject().grid;
    const auto pixel = [&](glm::dvec3 at) {
        return to_im(pixel_of(state, grid, panel, at).value() + 0.5);
    };
    for (const auto& [from, to] : work.mesh_pulling().mesh()->cut(
             state.crosshair_mm, state.slices[static_cast<size_t>(panel)].towards))
        list.AddLine(pixel(from), pixel(to), kMarkTool, width);
    list.PopClipRect();
}

} // namespace palpate::view
