// The bar at the top: the name of the work, the tasks, and undo, redo, save and the side panel.

#include <imgui/imgui.h>

#include <algorithm>
#include <cmath>

#include "apps/view/drawing/looks.h"
#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"
#include "engine/volume/extent.h"

namespace palpate::view {

namespace {

// Lengths at a text scale of 1.
constexpr float kEdge_px = 12.0f, kLeastPad_px = 4.0f, kMostPad_px = 14.0f, kIconSide_px = 30.0f,
                kLeastName_px = 60.0f, kMostName_px = 260.0f;

float bold_width(const char* text) {
    ImFont* const font = bold_letters();
    return font->CalcTextSizeA(font->FontSize, FLT_MAX, 0.0f, text).x;
}

struct BarRow { // while it is drawn, from the left to the right
    float top, height, scale;

    float center(float of_height) const { return top + std::round(0.5f * (height - of_height)); }
};

// A word that can be pressed. The chosen one is bold.
bool word_button(Widgets& ui, const BarRow& row, float left, float width, const char* word,
                 const std::string& id, bool is_chosen, const ViewState& state) {
    const Theme& theme = theme_of(state.light);
    const float height = std::min(28.0f * row.scale, row.height);
    const ImVec2 low(left, row.center(height)), high(left + width, low.y + height);
    ImGui::SetCursorScreenPos(low);
    const bool pressed = ImGui::InvisibleButton(id.c_str(), {width, height});
    ui.note(id);
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const float rounding = ImGui::GetStyle().FrameRounding;
    if (is_chosen)
        list.AddRectFilled(low, high, ImGui::GetColorU32(rgb_color(theme.accent, theme.chosen)),
                           rounding);
    else if (ImGui::IsItemHovered())
        list.AddRectFilled(low, high, ImGui::GetColorU32(rgb_color(theme.line)), rounding);
    ImFont* const font = is_chosen ? bold_letters() : ImGui::GetFont();
    const float text = font->CalcTextSizeA(font->FontSize, FLT_MAX, 0.0f, word).x;
    list.AddText(font, font->FontSize,
                 {left + std::round(0.5f * (width - text)), row.center(font->FontSize)},
                 ImGui::GetColorU32(rgb_color(is_chosen ? theme.accent_text : theme.text)), word);
    return pressed;
}

// The name of the work, which opens another one. Returns where it ends.
float draw_name(Widgets& ui, const BarRow& row, float left, float most, ViewState& state,
                Work& work) {
    const Theme& theme = theme_of(state.light);
    const std::string whole = state.names_hidden ? "(name hidden)" : work.title();
    ImGui::PushFont(bold_letters());
    const std::string name = fitted(whole, most);
    const ImVec2 size = ImGui::CalcTextSize(name.c_str());
    ImGui::SetCursorScreenPos({left, row.center(size.y)});
    const bool pressed = ImGui::InvisibleButton("top/open", {std::max(size.x, 1.0f), size.y});
    ui.note("top/open");
    const bool is_under = ImGui::IsItemHovered();
    ImGui::GetWindowDrawList()->AddText(
        ImGui::GetItemRectMin(),
        ImGui::GetColorU32(rgb_color(is_under ? theme.accent_text : theme.text)), name.c_str());
    const float end = ImGui::GetItemRectMax().x;
    ImGui::PopFont();
    if (is_under)
        ImGui::SetTooltip("%s\n%s\nclick: open another (Ctrl+O)", whole.c_str(),
                          samples_text(work).c_str());
    if (pressed) {
        state.browser_open = true;
        state.browsing = Browsing::documents;
    }
    return end;
}

// The tasks, or the chosen one with a list of all where they have no room.
void draw_tasks(Widgets& ui, const BarRow& row, float left, float pad, bool is_list,
                ViewState& state) {
    const auto take = [&](WindowTask task) {
        if (state.task == WindowTask::drill && task != WindowTask::drill)
            state.hand_put_down = state.stylus.by_pointer;
        state.tools_open = state.tools_open || state.task != task;
        state.task = task;
    };
    if (!is_list) {
        for (const WindowTask task : kTasks) {
            const float width = std::ceil(bold_width(title_of(task)) + 2.0f * pad);
            if (word_button(ui, row, left, width, title_of(task),
                            fmt::format("task/{}", name_of(task)), state.task == task, state))
                take(task);
            left += width;
        }
        return;
    }
    const float width = std::ceil(bold_width(title_of(state.task)) + 2.0f * pad);
    if (word_button(ui, row, left, width, title_of(state.task), "task", true, state))
        ImGui::OpenPopup("tasks");
    if (ImGui::BeginPopup("tasks")) {
        for (const WindowTask task : kTasks) {
            if (ImGui::Selectable(title_of(task), state.task == task))
                take(task);
            ui.note(fmt::format("task/{}", name_of(task)));
        }
        ImGui::EndPopup();
    }
}

void draw_icons(Widgets& ui, const BarRow& row, float left, float side, ViewState& state,
                Work& work) {
    const EditState edit = work.edited();
    const std::vector<std::string> titles = work.session().step_titles();
    const auto title = [&](size_t step) { return step < titles.size() ? " " + titles[step] : ""; };
    const auto button = [&](IconButton one) {
        one.side_px = side;
        ImGui::SetCursorScreenPos({left, row.center(side)});
        left += side;
        return draw_icon_button(ui, one, state);
    };
    if (button({.id = "tool/undo",
                .icon = Icon::undo,
                .letters = "<",
                .tip = fmt::format("Undo{} (Ctrl+Z)", title(edit.undo_steps - 1)),
                .is_possible = edit.undo_steps > 0}))
        ui.order(order::Undo{});
    if (button({.id = "tool/redo",
                .icon = Icon::redo,
                .letters = ">",
                .tip = fmt::format("Redo{} (Ctrl+Y)", title(edit.undo_steps)),
                .is_possible = edit.redo_steps > 0}))
        ui.order(order::Redo{});
    if (button({.id = "tool/save",
                .icon = Icon::save,
                .letters = "Sa",
                .tip = "Save to a project folder (Ctrl+S)"}))
        ui.order(order::Save{});
    if (button({.id = "panel/toggle",
                .icon = state.tools_open ? Icon::right : Icon::left,
                .letters = state.tools_open ? ">|" : "|<",
                .tip = state.tools_open ? "Hide the panel (T)" : "Show the panel (T)"}))
        state.tools_open = !state.tools_open;
}

} // namespace

void draw_top_bar(Widgets& ui, ViewState& state, Work& work) {
    const Box box = places_of(state).top;
    if (box.size_px.y <= 0)
        return;
    begin_bar("top", box);
    const auto scale = static_cast<float>(state.text_scale);
    const auto width = static_cast<float>(box.size_px.x);
    const BarRow row{static_cast<float>(box.low_px.y), static_cast<float>(box.size_px.y), scale};
    constexpr float kIcons = 4.0f, kWords = static_cast<float>(std::size(kTasks));
    const float side = std::floor(std::min(kIconSide_px * scale, row.height - 2.0f));
    const float icons = kIcons * side, edge = std::min(kEdge_px * scale, 0.02f * width);
    float words = 0.0f; // without what is round them
    for (const WindowTask task : kTasks)
        words += bold_width(title_of(task));
    // Words are closer to each other, and then a list, where the bar is too narrow.
    const float room = width - icons - 3.0f * edge;
    const bool is_list = words + 2.0f * kWords * kLeastPad_px * scale > room;
    const float name_least = std::min(kLeastName_px * scale, 0.25f * room);
    const float pad = std::clamp((room - words - name_least) / (2.0f * kWords),
                                 kLeastPad_px * scale, kMostPad_px * scale);
    const float tasks = is_list ? bold_width(title_of(state.task)) + 2.0f * pad
                                : std::ceil(words + 2.0f * kWords * pad) + kWords;
    const float name_most = std::min(room - tasks, kMostName_px * scale);
    float left = edge;
    if (name_most >= name_least)
        left = std::round(draw_name(ui, row, left, name_most, state, work) + edge);
    draw_tasks(ui, row, left, pad, is_list, state);
    draw_icons(ui, row, width - edge - icons, side, state, work);
    ImGui::End();
}

} // namespace palpate::view
