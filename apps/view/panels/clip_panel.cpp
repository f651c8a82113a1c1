// Clip planes: their list, and their marks over the views.

#include <imgui/imgui.h>

#include <algorithm>

#include "apps/view/drawing/mark_drawing.h"
#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"
#include "apps/view/tools/clip_tool.h"

namespace palpate::view {

void draw_clips(ImDrawList& list, const ViewState& state, Work& work, Panel panel, const Box& box) {
    if (!is_shown(state, Section::clips))
        return;
    const Grid& grid = work.subject().grid;
    list.PushClipRect(to_im(glm::dvec2(box.low_px)), to_im(glm::dvec2(box.low_px + box.size_px)),
                      true);
    const auto line = [&](glm::dvec3 a, glm::dvec3 b, ImU32 color) {
        const auto pa = pixel_of(state, grid, panel, a), pb = pixel_of(state, grid, panel, b);
        if (!pa || !pb)
            return;
        list.AddLine(to_im(*pa + 1.5), to_im(*pb + 1.5), kMarkShadow, 1.5f);
        list.AddLine(to_im(*pa + 0.5), to_im(*pb + 0.5), color, 1.5f);
    };
    const auto color_of = [&](size_t plane) {
        return state.clipping.selected == plane ? kMarkChosen : kPlane;
    };
    for (size_t i = 0; i < state.notes.clip_planes.size(); ++i) {
        if (is_slice(panel)) {
            if (const auto ends = clip_line(state, grid, panel, i)) {
                line(ends->first, ends->second, color_of(i));
                // A short line to the side that is kept.
                const glm::dvec3 middle = 0.5 * (ends->first + ends->second),
                                 towards = state.slices[static_cast<size_t>(panel)].towards;
                const glm::dvec3 n = state.notes.clip_planes[i].normal;
                const glm::dvec3 in = n - glm::dot(n, towards) * towards;
                if (glm::length(in) > 1e-6)
                    line(middle,
                         middle + 16.0 *
                                      mm_per_px(state.slices[static_cast<size_t>(panel)], grid,
                                                box.size_px) *
                                      glm::normalize(in),
                         color_of(i));
            }
            continue;
        }
        const auto outline = clip_outline(grid, state.notes.clip_planes, i);
        for (size_t k = 0; k < outline.size(); ++k)
            line(outline[k], outline[(k + 1) % outline.size()], color_of(i));
    }
    for (const ClipHandle& handle : clip_handles(state, grid, panel)) {
        const ImVec2 at = to_im(handle.at_px + 0.5);
        if (handle.turns) {
            list.AddCircle(at, 6.0f, kMarkShadow, 0, 3.5f);
            list.AddCircle(at, 6.0f, color_of(handle.plane), 0, 1.5f);
        } else {
            list.AddCircleFilled(at, 6.5f, kMarkShadow);
            list.AddCircleFilled(at, 5.0f, color_of(handle.plane));
        }
    }
    list.PopClipRect();
}

void draw_clip_panel(Widgets& ui, ViewState& state, Work& work) {
    Clipping& clipping = state.clipping;
    const Grid& grid = work.subject().grid;
    if (ImGui::Button("crop box"))
        set_crop_box(state, grid);
    ui.note("clip/box");
    ImGui::SameLine();
    ImGui::BeginDisabled(state.notes.clip_planes.size() >= kMaxClipPlanes);
    if (ImGui::Button("add plane"))
        add_clip_plane(state);
    ImGui::EndDisabled();
    ui.note("clip/add");
    ImGui::SameLine();
    ImGui::BeginDisabled(state.notes.clip_planes.empty());
    if (ImGui::Button("none")) {
        state.notes.clip_planes.clear();
        clipping.selected.reset();
    }
    ImGui::EndDisabled();
    ui.note("clip/none");
    ImGui::Separator();
    for (size_t i = 0; i < state.notes.clip_planes.size(); ++i) {
        ClipPlane& plane = state.notes.clip_planes[i];
        ImGui::PushID(static_cast<int>(i));
        const std::string name = fmt::format("{}  keeps {}", i + 1, letters_of(plane.normal));
        if (ImGui::Selectable(name.c_str(), clipping.selected == i))
            clipping.selected = i;
        ui.note(fmt::format("clip/row/{}", i));
        ImGui::PopID();
    }
    if (state.notes.clip_planes.empty())
        ImGui::TextDisabled("nothing is cut away in 3D");
    if (clipping.selected && *clipping.selected < state.notes.clip_planes.size()) {
        ClipPlane& plane = state.notes.clip_planes[*clipping.selected];
        double along = glm::dot(plane.normal, plane.point_mm - center_mm(grid));
        const double most = extent_mm(grid), least = -most;
        if (ImGui::DragScalar(named("place").c_str(), ImGuiDataType_Double, &along, 0.2f, &least,
                              &most, "%.1f mm", ImGuiSliderFlags_AlwaysClamp))
            plane.point_mm = center_mm(grid) + along * plane.normal;
        ui.note("clip/mm");
        if (ImGui::Button("other side"))
            plane.normal = -plane.normal;
        ui.note("clip/flip");
        ImGui::SameLine();
        if (ImGui::Button("through crosshair"))
            plane.point_mm = state.crosshair_mm;
        ui.note("clip/here");
        if (ImGui::Button("remove")) {
            state.notes.clip_planes.erase(state.notes.clip_planes.begin() +
                                          static_cast<ptrdiff_t>(*clipping.selected));
            clipping.selected.reset();
        }
        ui.note("clip/remove");
    }
    ImGui::TextDisabled("drag the discs to move,\nthe rings in slices to turn");
}

} // namespace palpate::view
