// Marks over the views.

#include <imgui/imgui.h>

#include <algorithm>
#include <cmath>

#include "apps/view/drawing/mark_drawing.h"
#include "apps/view/panels/interface.h"
#include "apps/view/tools/tool.h"
#include "apps/view/window/interaction.h"

namespace palpate::view {

namespace {

constexpr ImU32 kText = IM_COL32(225, 225, 215, 255), kShadow = IM_COL32(0, 0, 0, 200);

// Colours of planes and their lines: axial red, coronal green, sagittal yellow.
ImU32 color_of(Panel panel, int alpha = 255) {
    switch (panel) {
        case Panel::axial:
            return IM_COL32(255, 143, 122, alpha);
        case Panel::coronal:
            return IM_COL32(126, 226, 168, alpha);
        case Panel::sagittal:
            return IM_COL32(255, 212, 121, alpha);
        case Panel::volume:
            return IM_COL32(143, 180, 255, alpha);
    }
    return kText;
}

// Text whose box lies at `at` less `anchor` (0 .. 1) of its size; with a dark rim, so that it can
// be read on anything.
void write(ImDrawList& list, glm::dvec2 at, glm::dvec2 anchor, const std::string& text,
           ImU32 color = kText) {
    const ImVec2 size = ImGui::CalcTextSize(text.c_str());
    const ImVec2 low(std::round(static_cast<float>(at.x) - static_cast<float>(anchor.x) * size.x),
                     std::round(static_cast<float>(at.y) - static_cast<float>(anchor.y) * size.y));
    for (const float x : {-1.0f, 0.0f, 1.0f})
        for (const float y : {-1.0f, 0.0f, 1.0f})
            if (x != 0.0f || y != 0.0f)
                list.AddText(ImVec2(low.x + x, low.y + y), kShadow, text.c_str());
    list.AddText(low, color, text.c_str());
}

// Pixels of the window that a text, or the scale bar, takes.
struct Room {
    glm::dvec2 low, high;
};

Room room_of(glm::dvec2 at, glm::dvec2 anchor, const std::string& text) {
    const ImVec2 size = ImGui::CalcTextSize(text.c_str());
    const glm::dvec2 extent(size.x, size.y), low = glm::round(at - anchor * extent);
    return {low, low + extent};
}

struct Marks {
    ImDrawList& list;
    const ViewState& state;
    Work& work;
    Panel panel;
    glm::dvec2 low, size;
    double letter; // height of a line
    double edge;   // room between marks and the edge
    std::vector<ViewText>& texts;
    std::vector<Room> taken{}; // by what was drawn before, which is more important

    const Grid& grid() const { return work.subject().grid; }
    const SliceView& slice() const { return state.slices[static_cast<size_t>(panel)]; }

    // Whether it lies in the view, and apart from what is there. Lines may touch, words may not.
    bool is_free(const Room& room) const {
        if (room.low.x < low.x || room.low.y < low.y || room.high.x > low.x + size.x ||
            room.high.y > low.y + size.y)
            return false;
        const double gap = 0.5 * edge;
        return std::none_of(taken.begin(), taken.end(), [&](const Room& other) {
            return room.low.x < other.high.x + gap && other.low.x < room.high.x + gap &&
                   room.low.y < other.high.y && other.low.y < room.high.y;
        });
    }

    void put(glm::dvec2 at, glm::dvec2 anchor, const std::string& text, ImU32 color = kText) {
        const Room room = room_of(at, anchor, text);
        write(list, at, anchor, text, color);
        taken.push_back(room);
        texts.push_back({panel, text, {glm::ivec2(room.low), glm::ivec2(room.high - room.low)}});
    }

    // The first of the texts that has room, in the first of `lines` lines from `at` on in which it
    // has; else nothing. Where it was put.
    std::optional<glm::dvec2> put_free(glm::dvec2 at, glm::dvec2 anchor,
                                       std::initializer_list<std::string> wordings, int lines,
                                       ImU32 color = kText) {
        const double step = anchor.y > 0.5 ? -letter : letter; // away from the edge
        for (const std::string& text : wordings)
            for (int line = 0; line < lines; ++line) {
                const glm::dvec2 there = at + glm::dvec2(0.0, line * step);
                if (text.empty() || !is_free(room_of(there, anchor, text)))
                    continue;
                put(there, anchor, text, color);
                return there;
            }
        return std::nullopt;
    }

    void letters(glm::dvec3 right, glm::dvec3 up) {
        const glm::dvec2 middle = low + 0.5 * size;
        put({low.x + edge, middle.y}, {0.0, 0.5}, letters_of(-right));
        put({low.x + size.x - edge, middle.y}, {1.0, 0.5}, letters_of(right));
        put({middle.x, low.y + edge}, {0.5, 0.0}, letters_of(up));
        put({middle.x, low.y + size.y - edge}, {0.5, 1.0}, letters_of(-up));
    }

    void crosshair() const {
        const glm::dvec2 at = pixel_of(state, grid(), panel, state.crosshair_mm).value() + 0.5;
        constexpr double kOpen_px = 7.0;
        const double far = size.x + size.y;
        for (const Panel other : kPanels) {
            if (!is_slice(other) || other == panel)
                continue;
            const glm::dvec2 along = line_of(state, panel, other);
            for (const double side : {-1.0, 1.0})
                list.AddLine(to_im(at + side * kOpen_px * along), to_im(at + side * far * along),
                             color_of(other, 150));
        }
        const bool turns = state.under == panel && state.tool == &kCrosshairTool;
        if (turns || (state.drag && state.drag->kind == Drag::Kind::turn))
            for (const Handle& handle : handles_of(state, grid(), panel))
                list.AddCircle(to_im(handle.at_px + 0.5), static_cast<float>(kHandle_px) - 2.0f,
                               color_of(handle.plane), 0, 1.5f);
    }

    void bar() {
        const ScaleBar bar =
            scale_bar(mm_per_px(slice(), grid(), glm::ivec2(size)), std::min(0.3 * size.x, 200.0));
        const glm::dvec2 end = low + size - glm::dvec2(edge, edge + 2.0);
        const glm::dvec2 begin = end - glm::dvec2(std::round(bar.px), 0.0);
        const std::string length = length_text(bar.mm);
        // Above its middle, but not beyond the edge.
        const double half = 0.5 * static_cast<double>(ImGui::CalcTextSize(length.c_str()).x);
        const glm::dvec2 over(std::min(0.5 * (begin.x + end.x), end.x - half), end.y - 5.0);
        const Room words = room_of(over, {0.5, 1.0}, length);
        const Room all{{std::min(begin.x, words.low.x), words.low.y}, end + glm::dvec2(0.0, 2.0)};
        if (!is_free(all))
            return;
        for (const auto& [color, thick] : {std::pair(kShadow, 4.0f), {kText, 2.0f}}) {
            list.AddLine(to_im(begin), to_im(end), color, thick);
            for (const glm::dvec2 tip : {begin, end})
                list.AddLine(to_im(tip - glm::dvec2(0.0, 4.0)), to_im(tip + glm::dvec2(0.0, 2.0)),
                             color, thick);
        }
        put(over, {0.5, 1.0}, length);
        taken.back() = all;
    }

    void notes(const PictureState& picture) {
        const glm::dvec2 corner = low + edge;
        put_free(corner, {0.0, 0.0}, {title_of(panel)}, 2, color_of(panel));
        glm::dvec2 foot(low.x + edge, low.y + size.y - edge);
        if (is_slice(panel)) {
            const std::string place = place_text(grid(), state.crosshair_mm, slice().towards);
            // In a narrow view it lies above the letters in the middle of the edge, whatever they
            // are, and above the scale bar.
            const double widest = ImGui::CalcTextSize("MMM").x; // of letters_of()
            if (edge + ImGui::CalcTextSize(place.c_str()).x > 0.5 * (size.x - widest))
                foot.y -= letter;
            double width = state.window.high - state.window.low;
            double level = 0.5 * (state.window.low + state.window.high);
            if (are_whole_enough(work.subject().range)) {
                width = std::max(1.0, std::round(width));
                level = std::round(level);
            }
            const std::string short_place = place.substr(0, place.find(','));
            foot = put_free(foot, {0.0, 1.0}, {place, short_place}, 3).value_or(foot);
            put_free({low.x + size.x - edge, corner.y}, {1.0, 0.0},
                     {window_text(level - 0.5 * width, level + 0.5 * width)}, 2);
            std::string more;
            if (std::abs(slice().zoom - 1.0) > 0.005)
                more = fmt::format("zoom {:.2f}", slice().zoom);
            if (state.slab_mm > 0.0)
                more += fmt::format("{}{} of {:.3g} mm", more.empty() ? "" : ", ",
                                    state.slab_mode == SlabMode::maximum   ? "maximum"
                                    : state.slab_mode == SlabMode::minimum ? "minimum"
                                                                           : "mean",
                                    state.slab_mm);
            put_free(foot - glm::dvec2(0.0, letter), {0.0, 1.0}, {more}, 2);
        } else if (!picture.complete) {
            put_free(foot, {0.0, 1.0},
                     {fmt::format("refining, error {:.3f}", picture.error_estimate), "refining"},
                     2);
        }
    }

    void tool() const {
        if (!state.tool->has_radius || state.under != panel)
            return;
        const double radius = state.radius_mm / mm_per_px(slice(), grid(), glm::ivec2(size));
        draw_circle(list, state.pointer_px + 0.5, std::max(radius, 1.0), kMarkTool, 1.5f);
    }

    // Marks the crosshair's place in the volume.
    void spot() const {
        const auto at = pixel_of(state, grid(), panel, state.crosshair_mm);
        if (!at)
            return;
        for (const glm::dvec2 arm : {glm::dvec2(6.0, 0.0), glm::dvec2(0.0, 6.0)})
            for (const double side : {-1.0, 1.0})
                list.AddLine(to_im(*at + 0.5 + 0.4 * side * arm), to_im(*at + 0.5 + side * arm),
                             kMarkTool, 1.5f);
    }
};

} // namespace

void draw_marks(ImDrawList& list, const ViewState& state, Work& work, Panel panel, const Box& box,
                const PictureState& picture, std::vector<ViewText>& texts) {
    const glm::dvec2 low(box.low_px), size(box.size_px);
    const ImVec2 from = to_im(low), to = to_im(low + size);
    list.PushClipRect(from, to, true);
    // Two eyes beside each other may leave the last column or row free.
    const glm::dvec2 picture_size =
        is_slice(panel) || !state.stereo.on
            ? size
            : glm::dvec2(display_size_px(eye_size_px(state.stereo, glm::uvec2(box.size_px)),
                                         state.stereo.layout));
    if (picture.there)
        list.AddImage(
            reinterpret_cast<ImTextureID>(static_cast<uintptr_t>(Interface::texture_of(panel))),
            from, to_im(low + picture_size));
    const double letter = ImGui::GetTextLineHeight();
    Marks marks{list, state, work, panel, low, size, letter, std::round(0.5 * letter), texts};
    if (is_slice(panel)) {
        if (state.crosshair_shown)
            marks.crosshair();
        marks.tool();
    } else if (state.crosshair_shown && !state.stereo.on) { // in stereo it has its depth
        marks.spot();
    }
    if (state.notes_shown) {
        if (is_slice(panel)) {
            marks.letters(marks.slice().right, marks.slice().up);
            marks.bar();
        } else {
            const View view = make_view(state.camera, glm::uvec2(glm::max(box.size_px, 1)));
            const bool mirrored = state.stereo.on && state.stereo.mirror;
            marks.letters(view.right, mirrored ? -view.up : view.up);
        }
        marks.notes(picture);
    }
    constexpr double kLong_s = 0.5; // most pictures come sooner
    if (!picture.there)
        write(list, low + 0.5 * size, {0.5, 0.5}, "drawing ..");
    else if (picture.waited_s > kLong_s)
        marks.put_free(low + 0.5 * size, {0.5, 0.5},
                       {fmt::format("drawing .. {:.0f} s", std::ceil(picture.waited_s))}, 1);
    list.PopClipRect();
}

} // namespace palpate::view
