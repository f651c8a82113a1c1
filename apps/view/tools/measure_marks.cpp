// Measures over the views.

#include <imgui/imgui.h>

#include <algorithm>
#include <cmath>

#include "apps/view/drawing/mark_drawing.h"
#include "apps/view/panels/interface.h"
#include "apps/view/tools/measure_tool.h"
#include "engine/measure/measure_report.h"

namespace palpate::view {

namespace {

constexpr ImU32 kLine = IM_COL32(255, 214, 80, 255);

struct Drawing {
    ImDrawList& list;
    const ViewState& state;
    const Grid& grid;
    Panel panel;
    ImU32 color;
    double text_scale;

    std::optional<glm::dvec2> pixel(glm::dvec3 p) const {
        const auto at = pixel_of(state, grid, panel, p);
        return at ? std::optional(*at + 0.5) : std::nullopt;
    }
    bool shows(glm::dvec3 p) const { return !is_slice(panel) || lies_in(state, grid, panel, p); }
    float width() const { return static_cast<float>(1.5 * text_scale); }

    void line(glm::dvec2 a, glm::dvec2 b) const {
        list.AddLine(to_im(a + 1.0), to_im(b + 1.0), kMarkShadow, width());
        list.AddLine(to_im(a), to_im(b), color, width());
    }
    // A line in the slice, or the dot where it goes through.
    void segment(glm::dvec3 a, glm::dvec3 b) const {
        const auto pa = pixel(a), pb = pixel(b);
        if (!pa || !pb)
            return;
        if (shows(a) && shows(b)) {
            line(*pa, *pb);
            return;
        }
        const glm::dvec3 towards = state.slices[static_cast<size_t>(panel)].towards;
        const double da = glm::dot(a - state.crosshair_mm, towards),
                     db = glm::dot(b - state.crosshair_mm, towards);
        if (da * db > 0.0 || da == db)
            return;
        if (const auto at = pixel(a + da / (da - db) * (b - a)))
            list.AddCircleFilled(to_im(*at), 2.0f * width(), color);
    }
    void round(glm::dvec2 middle, double radius_px) const {
        list.AddCircle(to_im(middle + 1.0), static_cast<float>(radius_px), kMarkShadow, 64,
                       width());
        list.AddCircle(to_im(middle), static_cast<float>(radius_px), color, 64, width());
    }
    void sphere(const Measure& measure) const {
        const glm::dvec3 center = measure.points_mm[0];
        const double r = glm::distance(center, measure.points_mm[1]);
        const auto at = pixel(center);
        if (!at)
            return;
        if (is_slice(panel)) {
            const SliceView& slice = state.slices[static_cast<size_t>(panel)];
            const double off = glm::dot(center - state.crosshair_mm, slice.towards);
            if (std::abs(off) < r)
                round(*at, std::sqrt(r * r - off * off) /
                               mm_per_px(slice, grid, box_of(state, panel).value().size_px));
            return;
        }
        // Its circle across the view; the eye is far compared with its radius.
        const View view = make_view(state.camera, glm::uvec2(1));
        glm::dvec2 last(0.0);
        for (int i = 0; i <= 48; ++i) {
            const double turn = 2.0 * M_PI * i / 48.0;
            const auto rim =
                pixel(center + r * (std::cos(turn) * view.right + std::sin(turn) * view.up));
            if (!rim)
                return;
            if (i > 0)
                line(last, *rim);
            last = *rim;
        }
    }
    void lines(const Measure& measure) const {
        const auto& p = measure.points_mm;
        if (measure.kind == MeasureKind::sphere)
            return sphere(measure);
        for (size_t i = 0; i + 1 < p.size(); ++i)
            segment(p[i], p[i + 1]);
        if (measure.kind == MeasureKind::polygon)
            segment(p.back(), p.front());
    }
    void handle(glm::dvec3 p) const {
        const auto at = pixel(p);
        if (!at || !shows(p))
            return;
        const auto r = static_cast<float>(3.0 * text_scale);
        list.AddCircleFilled(to_im(*at), r + 1.0f, kMarkShadow);
        list.AddCircleFilled(to_im(*at), r, color);
    }
    void text(glm::dvec3 beside, const std::string& words) const {
        const auto at = pixel(beside);
        if (!at || words.empty())
            return;
        const ImVec2 size = ImGui::CalcTextSize(words.c_str());
        const Box box = box_of(state, panel).value();
        const glm::dvec2 low(box.low_px), high = low + glm::dvec2(box.size_px);
        // Within the view, whatever it names.
        const glm::dvec2 from =
            glm::clamp(*at + glm::dvec2(8.0, -double{size.y} - 4.0), low + 2.0,
                       glm::max(low + 2.0, high - glm::dvec2(size.x, size.y) - 4.0));
        list.AddRectFilled(to_im(glm::round(from) - glm::dvec2(3.0, 1.0)),
                           to_im(glm::round(from) + glm::dvec2(size.x + 3.0f, size.y + 1.0f)),
                           IM_COL32(0, 0, 0, 150), 2.0f);
        list.AddText(to_im(glm::round(from)), color, words.c_str());
    }
};

// The place of the text: an angle's at its vertex, a sphere's on its rim, else at the last point.
glm::dvec3 named_at(const Measure& measure) {
    return measure.points_mm[measure.kind == MeasureKind::angle    ? 1
                             : measure.kind == MeasureKind::sphere ? 1
                                                                   : measure.points_mm.size() - 1];
}

} // namespace

void draw_measures(ImDrawList& list, const ViewState& state, Work& work, Panel panel,
                   const Box& box) {
    const Measuring& measuring = state.measuring;
    const ImVec2 low = to_im(glm::dvec2(box.low_px)),
                 high = to_im(glm::dvec2(box.low_px + box.size_px));
    list.PushClipRect(low, high, true);
    Drawing draw{list, state, work.subject().grid, panel, kLine, state.text_scale};
    for (size_t i = 0; i < state.notes.measures.size(); ++i) {
        const Measure& measure = state.notes.measures[i];
        draw.color = measuring.selected == i ? kMarkChosen : kLine;
        draw.lines(measure);
        const bool is_held = measuring.selected == i || state.tool == &kMeasureTool;
        if (is_held && (is_slice(panel) || measure.kind != MeasureKind::polygon))
            for (const glm::dvec3 p : measure.points_mm)
                draw.handle(p);
        if (!draw.shows(named_at(measure)))
            continue;
        std::string words = measure.name.empty() ? "" : measure.name + "  ";
        if (const auto measured = work.measured(measure))
            words += headline(*measured);
        draw.text(named_at(measure), words);
    }
    draw.color = kMarkChosen; // of the one that is being placed, with the pointer as its next point
    std::vector<glm::dvec3> begun = measuring.begun;
    if (!begun.empty() && state.under == panel && is_slice(panel))
        begun.push_back(point_under(state, work.subject().grid, panel, state.pointer_px));
    if (begun.size() == 2 && measuring.kind == MeasureKind::sphere)
        draw.sphere({measuring.kind, begun});
    for (size_t i = 0; i + 1 < begun.size() && measuring.kind != MeasureKind::sphere; ++i)
        draw.segment(begun[i], begun[i + 1]);
    for (const glm::dvec3 p : measuring.begun)
        draw.handle(p);
    if (begun.size() == 2 && measuring.kind != MeasureKind::polygon &&
        measuring.begun.size() == 1) {
        const double mm = glm::distance(begun[0], begun[1]);
        if (measuring.kind != MeasureKind::angle)
            draw.text(begun[1], fmt::format("{}{:.1f} mm",
                                            measuring.kind == MeasureKind::sphere ? "r " : "", mm));
    }
    list.PopClipRect();
}

} // namespace palpate::view
