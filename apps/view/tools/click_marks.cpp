// Over slices: what a click of the tools that take regions would take.

#include "apps/view/document/work.h"
#include "apps/view/drawing/mark_drawing.h"
#include "apps/view/tools/click_tools.h"
#include "apps/view/tools/region_preview.h"
#include "apps/view/tools/wire_tool.h"

namespace palpate::view {

void draw_region(ImDrawList& list, const ViewState& state, Work& work, Panel panel,
                 const Box& box) {
    const Grid& grid = work.subject().grid;
    const auto& under = state.own.of<Clicking>().under;
    const auto& preview = state.own.of<Previewing>().preview;
    if (!takes_regions(*state.tool) || !under || !preview || !is_slice(panel))
        return;
    if (!state.own.of<Clicking>().is_outlined)
        return;
    preview->want(work.grey(), *under, work.threaded());
    const auto axis = axis_across(grid, state.slices[static_cast<size_t>(panel)]);
    const auto here = sample_at(grid, state.crosshair_mm);
    if (!axis || !here)
        return;
    // A layer of samples is shown by an affine map.
    const auto px_of = [&](glm::dvec3 index) {
        return pixel_of(state, grid, panel, world_point(grid, index)).value() + 0.5;
    };
    glm::dvec3 corner(0.0);
    corner[*axis] = (*here)[*axis];
    const glm::dvec2 first = px_of(corner);
    glm::dmat3x2 by(0.0);
    for (int a = 0; a < 3; ++a) {
        glm::dvec3 next = corner;
        next[a] += 1.0;
        if (a != *axis)
            by[a] = px_of(next) - first;
    }
    const glm::dvec2 low(box.low_px), high = low + glm::dvec2(box.size_px);
    list.PushClipRect(to_im(low), to_im(high), true);
    const auto width = static_cast<float>(1.5 * state.text_scale);
    const auto sides = preview->sides(*axis, (*here)[*axis]);
    constexpr size_t kMostShadowed = 4000; // sides; of more, as of noise, no shadow could be seen
    for (const auto& [color, thick] : {std::pair(kMarkShadow, 2.0f * width), {kMarkTool, width}})
        for (const auto& [from, to] : *sides)
            if (color != kMarkShadow || sides->size() <= kMostShadowed)
                list.AddLine(to_im(first + by * from), to_im(first + by * to), color, thick);
    list.PopClipRect();
}

} // namespace palpate::view
