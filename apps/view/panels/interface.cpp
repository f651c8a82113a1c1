#include "apps/view/panels/interface.h"

#include <imgui/imgui.h>
#include <imgui/imgui_internal.h>

#include <algorithm>
#include <cmath>

#include "apps/view/drawing/looks.h"
#include "apps/view/panels/widget_help.h"
#include "apps/view/panels/widgets.h"
#include "apps/view/tools/tool.h"
#include "apps/view/window/keys.h"
#include "engine/base/failure.h"
#include "engine/gpu/error.h"

namespace palpate::view {

namespace {

// ImGui knows keys by numbers of ours: places in key_names().
int number_of(const std::string& key) {
    const auto& names = key_names();
    const auto found = std::find(names.begin(), names.end(), key);
    return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

Box box_between(const ImRect& rect) {
    return {{static_cast<int>(rect.Min.x), static_cast<int>(rect.Min.y)},
            {static_cast<int>(rect.GetWidth()), static_cast<int>(rect.GetHeight())}};
}

void name_keys(ImGuiIO& io) {
    const std::pair<int, const char*> keys[] = {{ImGuiKey_Tab, "tab"},
                                                {ImGuiKey_LeftArrow, "left"},
                                                {ImGuiKey_RightArrow, "right"},
                                                {ImGuiKey_UpArrow, "up"},
                                                {ImGuiKey_DownArrow, "down"},
                                                {ImGuiKey_PageUp, "page_up"},
                                                {ImGuiKey_PageDown, "page_down"},
                                                {ImGuiKey_Home, "home"},
                                                {ImGuiKey_End, "end"},
                                                {ImGuiKey_Insert, "insert"},
                                                {ImGuiKey_Delete, "delete"},
                                                {ImGuiKey_Backspace, "backspace"},
                                                {ImGuiKey_Space, "space"},
                                                {ImGuiKey_Enter, "enter"},
                                                {ImGuiKey_Escape, "escape"},
                                                {ImGuiKey_A, "a"},
                                                {ImGuiKey_C, "c"},
                                                {ImGuiKey_V, "v"},
                                                {ImGuiKey_X, "x"},
                                                {ImGuiKey_Y, "y"},
                                                {ImGuiKey_Z, "z"}};
    for (const auto& [key, name] : keys)
        io.KeyMap[key] = number_of(name);
}

// The widget does in the next frame what a click on it does; a field takes the keys.
void activate(ImGuiID widget) {
#if IMGUI_VERSION_NUM >= 18980
    ImGui::ActivateItemByID(widget);
#else
    ImGui::ActivateItem(widget);
#endif
}

// Windows and lists in which a panel has stopped.
void end_what_was_begun() {
#if IMGUI_VERSION_NUM >= 19140
    ImGuiErrorRecoveryState none; // of the frame's begin
    none.SizeOfWindowStack = 1;
    ImGui::ErrorRecoveryTryToRecoverState(&none);
#else
    ImGui::ErrorCheckEndFrameRecover(nullptr);
#endif
}

} // namespace

Interface::Interface(double text_scale) {
    IMGUI_CHECKVERSION();
    ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.LogFilename = nullptr;
    io.BackendFlags |= ImGuiBackendFlags_RendererHasVtxOffset;
    name_keys(io);
    try {
        set_lengths(text_scale);
        use_theme(false);
        load_letters(text_scale);
    } catch (const std::exception&) {
        ImGui::DestroyContext();
        throw;
    }
}

Interface::~Interface() {
    ImGui::DestroyContext();
}

bool Interface::takes(const Event& event) const {
    const ImGuiIO& io = ImGui::GetIO();
    switch (event.kind) {
        case Event::Kind::move:
        case Event::Kind::button:
        case Event::Kind::wheel:
            return io.WantCaptureMouse;
        case Event::Kind::key:
            if (event.key == "enter" && !ui_.pointed_out.empty())
                return true; // it presses what was found
            [[fallthrough]];
        case Event::Kind::text:
            return io.WantTextInput ||
                   (event.key == "escape" && ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopup));
        case Event::Kind::resize:
        case Event::Kind::drop:
        case Event::Kind::close:
            return false;
    }
    return false;
}

void Interface::feed(const Event& event) {
    ImGuiIO& io = ImGui::GetIO();
    io.KeyShift = event.modifiers.shift;
    io.KeyCtrl = event.modifiers.ctrl;
    io.KeyAlt = event.modifiers.alt;
    const bool mine = event.for_widget;
    switch (event.kind) {
        case Event::Kind::move:
            io.MousePos =
                ImVec2(static_cast<float>(event.at_px.x), static_cast<float>(event.at_px.y));
            break;
        case Event::Kind::button: {
            const int button = event.button == Button::left    ? ImGuiMouseButton_Left
                               : event.button == Button::right ? ImGuiMouseButton_Right
                                                               : ImGuiMouseButton_Middle;
            io.MouseDown[button] = event.down && mine;
            break;
        }
        case Event::Kind::wheel:
            if (mine) {
                io.MouseWheelH += static_cast<float>(event.wheel.x);
                io.MouseWheel += static_cast<float>(event.wheel.y);
            }
            break;
        case Event::Kind::key:
            if (const int key = number_of(event.key); key >= 0)
                io.KeysDown[key] = event.down && mine;
            break;
        case Event::Kind::text:
            if (mine)
                io.AddInputCharactersUTF8(event.text.c_str());
            break;
        case Event::Kind::resize:
        case Event::Kind::drop:
        case Event::Kind::close:
            break;
    }
}

namespace {

// The gaps round the views, and in them a thin frame round the view in use. Outside of pictures.
void draw_frames(ImDrawList& list, const ViewState& state) {
    if (!state.bars_open)
        return;
    const Theme& theme = theme_of(state.light);
    const auto frame = [&](const Box& box, int thick_px, uint32_t rgb) {
        const ImU32 color = ImGui::GetColorU32(rgb_color(rgb));
        const glm::vec2 low(box.low_px - thick_px), high(box.low_px + box.size_px + thick_px);
        const auto thick = static_cast<float>(thick_px);
        list.AddRectFilled({low.x, low.y}, {high.x, low.y + thick}, color);
        list.AddRectFilled({low.x, high.y - thick}, {high.x, high.y}, color);
        list.AddRectFilled({low.x, low.y}, {low.x + thick, high.y}, color);
        list.AddRectFilled({high.x - thick, low.y}, {high.x, high.y}, color);
    };
    for (const Places::View& view : places_of(state).views)
        frame(view.box, kGap_px, theme.ground);
    const std::optional<Panel> in_use = state.drag ? state.drag->panel : state.under;
    if (const auto box = in_use ? box_of(state, *in_use) : std::nullopt)
        frame(*box, state.text_scale < 1.5 ? 1 : kGap_px, theme.accent);
}

} // namespace

void Widgets::note(const std::string& id) {
    const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
    const auto keep = [&](const std::string& name, const ImRect& whole) {
        places[name] = box_between(whole);
        ImRect part = whole;
        part.ClipWithFull(GImGui->CurrentWindow->ClipRect); // empty: its corners are one
        seen[name] = box_between(part);
    };
    keep(id, {low, high});
    const ImGuiLastItemData& last = GImGui->LastItemData;
    if (last.StatusFlags & ImGuiItemStatusFlags_HasDisplayRect) // of a slider: where one types
        keep(id + "/field", last.DisplayRect);
    if (id == pointed_out) {
        if (scrolls_to)
            ImGui::SetScrollHereY(0.3f);
        scrolls_to = scrolls_to && !ImGui::IsItemVisible();
        if (std::exchange(presses, false))
            activate(GImGui->LastItemData.ID);
        const ImVec2 by(3.0f, 2.0f);
        ImGui::GetForegroundDrawList()->AddRect(ImVec2(low.x - by.x, low.y - by.y),
                                                ImVec2(high.x + by.x, high.y + by.y),
                                                ImGui::GetColorU32(ImGuiCol_CheckMark), 3.0f);
    }
    if (!ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled) || ImGui::IsItemActive())
        return;
    if (const WidgetHelp* help = help_of(id)) {
        ImGui::BeginTooltip();
        ImGui::PushTextWrapPos(20.0f * ImGui::GetFontSize());
        ImGui::TextUnformatted(help->help);
        ImGui::PopTextWrapPos();
        ImGui::EndTooltip();
    }
}

bool Widgets::button(const char* text, const std::string& id, Order one) {
    const bool pressed = ImGui::Button(text);
    note(id);
    if (pressed)
        order(std::move(one));
    return pressed;
}

bool Widgets::primary(const char* text, const std::string& id, const ViewState& state) {
    const Theme& theme = theme_of(state.light);
    ImGui::PushStyleColor(ImGuiCol_Button, rgb_color(theme.accent));
    ImGui::PushStyleColor(ImGuiCol_Text, rgb_color(theme.on_accent));
    const bool pressed = ImGui::Button(text);
    ImGui::PopStyleColor(2);
    note(id);
    return pressed;
}

std::string time_left_text(double share, double seconds) {
    constexpr double kLeastShare = 0.02, kLeast_s = 2.0; // before these a rate is chance
    if (!(share >= kLeastShare) || share >= 1.0 || seconds < kLeast_s)
        return "";
    return about_text(seconds * (1.0 - share) / share) + " left";
}

std::string about_text(double seconds) {
    const double step_s = seconds < 20.0 ? 1.0 : seconds < 100.0 ? 5.0 : 60.0;
    const double told_s = std::max(1.0, std::ceil(seconds / step_s)) * step_s;
    return step_s < 60.0     ? fmt::format("about {:.0f} s", told_s)
           : told_s < 7200.0 ? fmt::format("about {:.0f} min", told_s / 60.0)
                             : fmt::format("about {:.0f} h", told_s / 3600.0);
}

double Widgets::seconds_since_begun(const std::string& id) {
    constexpr double kGap_s = 0.5; // without a bar, the next one is of other work
    Progress& bar = under_way.try_emplace(id, Progress{time_s, time_s}).first->second;
    if (time_s - bar.seen_s > kGap_s)
        bar.began_s = time_s;
    bar.seen_s = time_s;
    return time_s - bar.began_s;
}

void Widgets::progress(const std::string& id, double share, const std::string& what,
                       const char* room) {
    const std::string left = time_left_text(share, seconds_since_begun(id));
    const std::string text = fmt::format("{}{}{:.0f} %{}{}", what, what.empty() ? "" : " ",
                                         100.0 * share, left.empty() ? "" : ", ", left);
    const float width = ImGui::GetContentRegionAvail().x - ImGui::CalcTextSize(room).x -
                        2.0f * ImGui::GetStyle().FramePadding.x - ImGui::GetStyle().ItemSpacing.x;
    // Whole words: the bar cuts what reaches into its ends.
    const float letters = width - 2.0f * ImGui::GetStyle().ItemInnerSpacing.x;
    std::string shown = text;
    for (const std::string& shorter :
         {left.empty() ? what : fmt::format("{:.0f} %, {}", 100.0 * share, left),
          fmt::format("{:.0f} %", 100.0 * share)})
        if (ImGui::CalcTextSize(shown.c_str()).x > letters)
            shown = shorter;
    ImGui::ProgressBar(static_cast<float>(share), ImVec2(std::max(width, 1.0f), 0.0f),
                       shown.c_str());
    if (ImGui::IsItemHovered() && shown != text) { // above the bar and the pointer
        ImGui::SetNextWindowPos(ImGui::GetItemRectMin(), ImGuiCond_Always, ImVec2(0.0f, 1.0f));
        ImGui::SetTooltip("%s", text.c_str());
    }
    note(id);
}

void Widgets::check(const char* text, const std::string& id, bool& is_on) {
    ImGui::Checkbox(text, &is_on);
    note(id);
}

void Interface::begin_document() {
    status_.message.clear();
    side_.labels.sought = {};
    // Names of files are proposed anew.
    side_.labels.file = side_.measures_file = side_.files.figure_file = side_.files.mesh_file = {};
}

std::vector<Order> Interface::frame(const std::vector<Event>& events, double time_s,
                                    ViewState& state, Work& work,
                                    const std::array<PictureState, kPanels.size()>& pictures) {
    for (const Event& event : events)
        feed(event);
    ImGuiIO& io = ImGui::GetIO();
    io.DisplaySize =
        ImVec2(static_cast<float>(state.size_px.x), static_cast<float>(state.size_px.y));
    io.DeltaTime = static_cast<float>(std::clamp(time_s - ui_.time_s, 1e-3, 1.0));
    ui_.time_s = time_s;
    if (std::exchange(is_light_, state.light) != state.light)
        use_theme(state.light);
    ImGui::NewFrame();
    try {
        draw(events, state, work, pictures);
    } catch (const GpuError&) {
        throw;
    } catch (const std::exception& error) { // such as memory that ran out
        work.tell("panels: " + failure_text(error));
        end_what_was_begun();
    }
    busy_ = ImGui::IsAnyItemActive();
    ImGui::Render();
    return std::exchange(ui_.orders, {});
}

void Interface::draw(const std::vector<Event>& events, ViewState& state, Work& work,
                     const std::array<PictureState, kPanels.size()>& pictures) {
    if (ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape), false) && // such as a list
        ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopup))
        ImGui::ClosePopupToLevel(0, true);
    const bool acts = std::any_of(events.begin(), events.end(), [](const Event& event) {
        return event.down && (event.kind == Event::Kind::key || event.kind == Event::Kind::button);
    });
    // The head of a section has been opened already.
    ui_.presses = !ui_.pointed_out.empty() && !ui_.pointed_out.starts_with("section/") &&
                  std::any_of(events.begin(), events.end(), [](const Event& event) {
                      return event.down && event.kind == Event::Kind::key && event.key == "enter";
                  });
    if (acts && !ui_.presses) // a person goes on
        ui_.pointed_out.clear();
    if (ImGui::GetIO().MouseWheel != 0.0f) // where it goes is for the person to say
        ui_.scrolls_to = false;
    ui_.places.clear();
    ui_.seen.clear();
    texts_.clear();
    draw_top_bar(ui_, state, work);
    draw_tool_bar(ui_, state);
    draw_side_panel(ui_, side_, state, work);
    draw_status(ui_, status_, state, work);
    draw_touch_panel(ui_, side_.touch, state, work);
    draw_help(state);
    draw_search(ui_, search_, state, work);
    draw_questions(ui_, save_folder_, state, work);
    static const FilePreview kNone;
    draw_browser(ui_, browser_, side_.files.recent, file_preview_ ? *file_preview_ : kNone, state);
    draw_series_chooser(ui_, previews_, state, work);
    draw_welcome(ui_, welcome_, state);
    draw_opening(ui_, state);
    if (const auto& open = GImGui->OpenPopupStack; !open.empty() && open.back().Window)
        ui_.places["popup"] = ui_.seen["popup"] = box_between(open.back().Window->Rect());
    const bool has_paged = std::any_of(events.begin(), events.end(), [&](const Event& event) {
        return event.kind == Event::Kind::wheel && !event.for_widget && state.under &&
               is_slice(*state.under);
    });
    draw_hints(ui_, hints_, state, has_paged);
    ImDrawList& behind = *ImGui::GetBackgroundDrawList();
    draw_frames(behind, state);
    for (const Places::View& view : places_of(state).views) {
        draw_marks(behind, state, work, view.panel, view.box,
                   pictures[static_cast<size_t>(view.panel)], texts_);
        draw_clips(behind, state, work, view.panel, view.box);
        for (const Tool* tool : tools())
            if (tool->marks)
                tool->marks(behind, state, work, view.panel, view.box);
        draw_hand_marks(behind, state, work, view.panel, view.box);
    }
}

const ImDrawData& Interface::lists() const {
    return *ImGui::GetDrawData();
}

} // namespace palpate::view
