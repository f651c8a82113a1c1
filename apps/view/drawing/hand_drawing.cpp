// The hand over the views.

#include <imgui/imgui.h>

#include <algorithm>
#include <cmath>

#include "apps/view/drawing/hand_marks.h"
#include "apps/view/drawing/mark_drawing.h"
#include "apps/view/panels/interface.h"

namespace palpate::view {

namespace {

constexpr ImU32 kGhost = IM_COL32(200, 200, 200, 150), kForce = IM_COL32(255, 200, 60, 255),
                kAway = IM_COL32(90, 220, 255, 110);

void draw_arrow(ImDrawList& list, glm::dvec2 from, glm::dvec2 to) {
    const glm::dvec2 along = glm::normalize(to - from), across(-along.y, along.x);
    const double head = std::min(10.0, 0.5 * glm::distance(from, to));
    list.AddLine(to_im(from), to_im(to - head * along), kForce, 2.5f);
    list.AddTriangleFilled(to_im(to), to_im(to - head * along + 0.5 * head * across),
                           to_im(to - head * along - 0.5 * head * across), kForce);
}

// The names of the widgets in 3D, each on its plate.
void draw_names(ImDrawList& list, const ViewState& state, const Grid& grid) {
    const auto write = [&](const std::string& text, glm::dvec3 place_mm, float below) {
        const auto at = pixel_of(state, grid, Panel::volume, place_mm);
        const ImVec2 size = ImGui::CalcTextSize(text.c_str());
        if (at)
            list.AddText(ImVec2(std::round(static_cast<float>(at->x) - 0.5f * size.x),
                                std::round(static_cast<float>(at->y) + (below - 0.5f) * size.y)),
                         IM_COL32(240, 240, 240, 255), text.c_str());
        return at;
    };
    for (const Widget3d& widget : palette_of(state)) {
        const haptics::TouchPlate& plate = widget.plate;
        for (size_t row = 0; row < widget.rows.size(); ++row) {
            const double up = 1.0 - (2.0 * static_cast<double>(row) + 1.0) /
                                        static_cast<double>(widget.rows.size());
            write(widget.rows[row],
                  plate.top.position_mm +
                      plate.top.rotation * glm::dvec3(0.0, up * plate.half_mm.y, 0.0),
                  0.0f);
        }
        if (widget.kind == Widget3d::Kind::plane) {
            if (const auto at = write(widget.id, plate.top.position_mm, 1.0f))
                list.AddCircleFilled(to_im(*at + 0.5), 6.0f, kPlane);
        } else if (widget.rows.empty()) {
            write(widget.id, plate.top.position_mm, 0.0f);
        }
    }
}

// Over the picture, so also where something lies before it.
void draw_dust(ImDrawList& list, const ViewState& state, const Work& work, const Box& box) {
    const glm::dvec2 low(box.low_px);
    list.PushClipRect(to_im(low), to_im(low + glm::dvec2(box.size_px)), true);
    for (const DustCloud::Grain& grain : work.hand().dust().grains())
        if (const auto at = pixel_of(state, work.subject().grid, Panel::volume, grain.place_mm))
            list.AddRectFilled(
                to_im(*at), to_im(*at + 2.0),
                IM_COL32(235, 225, 205, static_cast<int>(200.0 * (1.0 - grain.age))));
    list.PopClipRect();
}

} // namespace

void draw_hand_marks(ImDrawList& list, const ViewState& state, Work& work, Panel panel,
                     const Box& box) {
    if (panel == Panel::volume && work.hand().touch().running())
        draw_names(list, state, work.subject().grid);
    if (panel == Panel::volume && state.stylus.dust_shown && !state.stereo.on)
        draw_dust(list, state, work, box);
    const std::optional<TouchSample>& now = work.hand().touch().now();
    if (!work.hand().touch().running() || !now)
        return;
    const auto marks = hand_marks(state, work.subject().grid, panel, *now);
    if (!marks)
        return;
    const glm::dvec2 low(box.low_px);
    list.PushClipRect(to_im(low), to_im(low + glm::dvec2(box.size_px)), true);
    const glm::dvec2 proxy = marks->proxy_px + 0.5, probe = marks->probe_px + 0.5;
    if (glm::distance(proxy, probe) > 1.5) {
        list.AddLine(to_im(proxy), to_im(probe), kGhost, 1.0f);
        list.AddCircleFilled(to_im(probe), 3.5f, kGhost);
    }
    // In 3D the picture holds the tool itself: the outline tells where it is behind something.
    draw_circle(list, proxy, std::max(2.0, marks->radius_px), marks->is_cut ? kMarkTool : kAway,
                is_slice(panel) && marks->is_cut ? 1.5f : 1.0f);
    if (state.stylus.arrow_shown && marks->arrow_to_px)
        draw_arrow(list, proxy, *marks->arrow_to_px + 0.5);
    list.PopClipRect();
}

} // namespace palpate::view
