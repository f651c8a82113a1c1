#include "apps/view/panels/interface.h"

#include <imgui/imgui.h>
#include <imgui/imgui_internal.h>

#include <algorithm>
#include <cmath>

#include "apps/view/drawing/looks.h"
#include "apps/view/tools/tool.h"
#include "apps/view/window/keys.h"

namespace palpate::view {

namespace {

// ImGui knows keys by numbers of ours: places in key_names().
int number_of(const std::string& key) {
    const auto& names = key_names();
    const auto found = std::find(names.begin(), names.end(), key);
    return found == names.end() ? -1 : static_cast<int>(found - names.begin());
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

// The colour of words that stand out.
ImVec4 accent(const ViewState& state) {
    return rgb_color(theme_of(state.light).warning);
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
    set_lengths(text_scale);
    use_theme(false);
    load_letters(text_scale);
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

void Interface::note(const char* id) {
    const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
    widgets_[id] = {{static_cast<int>(low.x), static_cast<int>(low.y)},
                    {static_cast<int>(high.x - low.x), static_cast<int>(high.y - low.y)}};
}

std::vector<Order> Interface::frame(const std::vector<Event>& events, double time_s,
                                    ViewState& state, Work& work,
                                    const std::array<PictureState, kPanels.size()>& pictures) {
    for (const Event& event : events)
        feed(event);
    ImGuiIO& io = ImGui::GetIO();
    io.DisplaySize =
        ImVec2(static_cast<float>(state.size_px.x), static_cast<float>(state.size_px.y));
    io.DeltaTime = static_cast<float>(std::clamp(time_s - time_s_, 1e-3, 1.0));
    time_s_ = time_s;
    if (std::exchange(is_light_, state.light) != state.light)
        use_theme(state.light);
    ImGui::NewFrame();
    if (ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape), false) && // such as a list
        ImGui::IsPopupOpen("", ImGuiPopupFlags_AnyPopup))
        ImGui::ClosePopupToLevel(0, true);
    widgets_.clear();
    texts_.clear();
    std::vector<Order> orders;
    bound_held_ = false;
    draw_tools(state, work, orders);
    if (!bound_held_ && !work.segmentation().share()) // taken, or no longer shown
        state.segmenting.preview.reset();
    tell_tool(state, work);
    draw_status(state, work);
    draw_touch(state, work, orders);
    draw_help(state);
    draw_questions(state, work, orders);
    draw_browser(state, orders);
    draw_series_chooser(state, work, orders);
    draw_opening(state, orders);
    ImDrawList& behind = *ImGui::GetBackgroundDrawList();
    for (const Places::View& view : places_of(state).views) {
        draw_marks(behind, state, work, view.panel, view.box,
                   pictures[static_cast<size_t>(view.panel)], texts_);
        draw_clips(behind, state, work, view.panel, view.box);
        for (const Tool* tool : tools())
            if (tool->marks)
                tool->marks(behind, state, work, view.panel, view.box);
        draw_hand_marks(behind, state, work, view.panel, view.box);
    }
    busy_ = ImGui::IsAnyItemActive();
    ImGui::Render();
    return orders;
}

const ImDrawData& Interface::lists() const {
    return *ImGui::GetDrawData();
}

// Kinds of a tool look the same over the views: the line at the bottom has the kind when it is
// taken into the hand, by a key or in the panel.
void Interface::tell_tool(const ViewState& state, Work& work) {
    std::string now = state.tool->how_to ? state.tool->how_to(state) : "";
    if (now != how_to_ && !now.empty())
        work.tell(now);
    how_to_ = std::move(now);
}

void Interface::draw_status(const ViewState& state, Work& work) {
    const Box box = places_of(state).status;
    if (box.size_px.y == 0)
        return;
    ImGui::SetNextWindowPos(
        ImVec2(static_cast<float>(box.low_px.x), static_cast<float>(box.low_px.y)));
    ImGui::SetNextWindowSize(
        ImVec2(static_cast<float>(box.size_px.x), static_cast<float>(box.size_px.y)));
    ImGui::PushStyleVar(
        ImGuiStyleVar_WindowPadding,
        ImVec2(6.0f, 0.5f * (static_cast<float>(box.size_px.y) - ImGui::GetTextLineHeight())));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, ImVec2(1.0f, 1.0f));
    ImGui::Begin("status", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus |
                     ImGuiWindowFlags_NoFocusOnAppearing);
    const bool in_slice = state.under && is_slice(*state.under);
    const glm::dvec3 at =
        in_slice ? point_under(state, work.subject().grid, *state.under, state.pointer_px)
                 : state.crosshair_mm;
    const std::string text = work.text_at(at);
    const std::string place =
        fmt::format("{} {}", in_slice ? "pointer" : "crosshair", text.empty() ? "outside" : text);
    ImGui::TextUnformatted(place.c_str());
    const EditState edit = work.edited();
    if (std::string message = work.take_message(); !message.empty()) {
        message_ = state.names_hidden ? work.saving().without_names(std::move(message)) : message;
        told_s_ = time_s_;
    }
    if (const double behind_s = work.hand().backlog().seconds; behind_s > HandLink::kFarBehind_s) {
        message_ =
            fmt::format("edits are {:.0f} s behind the hand; all of them will be done", behind_s);
        told_s_ = time_s_;
    }
    const auto width_of = [](const std::string& words) {
        return ImGui::CalcTextSize(words.c_str()).x;
    };
    // At the right as many of these words as do not reach the place.
    const std::string keys = "? keys";
    std::string right = fmt::format("{} edit{}, {} to redo   {}", edit.undo_steps,
                                    edit.undo_steps == 1 ? "" : "s", edit.redo_steps, keys);
    const float place_end = 6.0f + width_of(place + "  ");
    const auto begin_of = [&](const std::string& words) {
        return static_cast<float>(box.size_px.x) - width_of(words) - 8.0f;
    };
    if (begin_of(right) < place_end)
        right = begin_of(keys) < place_end ? "" : keys;
    const std::string told = message();
    const float told_end =
        6.0f + width_of(place) + ImGui::GetStyle().ItemSpacing.x + width_of("  " + told + "  ");
    const bool is_long = told_end > begin_of(right);
    if (!told.empty() && !is_long) {
        ImGui::SameLine();
        ImGui::TextColored(accent(state), "  %s", told.c_str());
        note("status/message");
    }
    if (!right.empty()) {
        ImGui::SameLine(begin_of(right));
        ImGui::TextUnformatted(right.c_str());
        note("status/steps");
    }
    ImGui::End();
    ImGui::PopStyleVar(2);
    if (!told.empty() && is_long)
        draw_long_message(state, told);
}

// On a plate above the line at the bottom, over the views; one that would fill more than half of
// their height is as wide as the window. The pointer passes through it.
void Interface::draw_long_message(const ViewState& state, const std::string& told) {
    const Places places = places_of(state);
    const ImVec2 pad(6.0f, 4.0f);
    const auto foot = static_cast<float>(places.status.low_px.y);
    float width = 0.0f, height = 0.0f;
    const auto fit = [&](int to_px) {
        width = static_cast<float>(to_px);
        height = 2.0f * pad.y +
                 ImGui::CalcTextSize(told.c_str(), nullptr, false, width - 2.0f * pad.x).y;
    };
    int views_end = 0;
    for (const Places::View& view : places.views)
        views_end = std::max(views_end, view.box.low_px.x + view.box.size_px.x);
    fit(views_end);
    if (height > 0.5f * foot)
        fit(places.status.size_px.x);
    height = std::min(height, foot);
    ImGui::SetNextWindowPos(ImVec2(0.0f, foot - height));
    ImGui::SetNextWindowSize(ImVec2(width, height));
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, pad);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowMinSize, ImVec2(1.0f, 1.0f));
    ImGui::Begin("message", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoInputs |
                     ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                     ImGuiWindowFlags_NoBringToFrontOnFocus | ImGuiWindowFlags_NoFocusOnAppearing);
    ImGui::PushStyleColor(ImGuiCol_Text, accent(state));
    ImGui::TextWrapped("%s", told.c_str());
    ImGui::PopStyleColor();
    note("status/message");
    ImGui::End();
    ImGui::PopStyleVar(2);
}

void Interface::draw_questions(ViewState& state, Work& work, std::vector<Order>& orders) {
    const auto begin = [&](const char* title, bool& open) {
        ImGui::SetNextWindowPos(ImVec2(0.5f * static_cast<float>(state.size_px.x),
                                       0.5f * static_cast<float>(state.size_px.y)),
                                ImGuiCond_Always, ImVec2(0.5f, 0.5f));
        ImGui::Begin(title, &open,
                     ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove |
                         ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings);
    };
    if (state.leaving && !state.leaving->saving) {
        bool open = true;
        begin("Edits are not saved", open);
        const std::string next = state.leaving->closes ? "the window closes"
                                 : state.names_hidden  ? "another file opens"
                                                       : state.leaving->path + " opens";
        ImGui::TextUnformatted(fmt::format("Save them before {}?", next).c_str());
        const bool pulled = work.mesh_pulling().is_pulled();
        if (pulled)
            ImGui::TextUnformatted(fmt::format("The pulled mesh is put into label {} first.",
                                               work.mesh_pulling().mesh()->label())
                                       .c_str());
        if (ImGui::Button("save")) {
            state.leaving->saving = true;
            state.leaving->applying = pulled;
            orders.push_back(pulled ? Order(order::ApplyMesh{}) : order::Save{});
        }
        note("leave/save");
        ImGui::SameLine();
        if (ImGui::Button("discard"))
            orders.push_back(order::Leave{});
        note("leave/discard");
        ImGui::SameLine();
        open &= !ImGui::Button("cancel");
        note("leave/cancel");
        ImGui::End();
        if (!open)
            state.leaving.reset();
    }
    if (state.recovered_steps > 0 && !state.leaving && state.opening.empty()) {
        bool open = true;
        begin("Steps were recovered", open);
        const size_t steps = state.recovered_steps;
        ImGui::TextUnformatted(fmt::format("{} step{} of a window that ended before {} saved.",
                                           steps, steps == 1 ? "" : "s",
                                           steps == 1 ? "it was" : "they were")
                                   .c_str());
        if (ImGui::Button("keep"))
            open = false;
        note("recovered/keep");
        ImGui::SameLine();
        if (ImGui::Button("undo them")) {
            for (size_t i = 0; i < steps; ++i)
                orders.push_back(order::Undo{});
            open = false;
        }
        note("recovered/undo");
        ImGui::End();
        if (!open)
            state.recovered_steps = 0;
    }
    if (state.saving_open) {
        begin("Save to a new project folder", state.saving_open);
        if (folder_[0] == '\0') {
            const std::string offered = state.saving_folder.empty()
                                            ? work.saving().new_folder(state.names_hidden)
                                            : state.saving_folder;
            std::copy_n(offered.begin(), std::min(offered.size(), folder_.size() - 1),
                        folder_.begin());
            state.saving_typing = true;
        }
        if (std::exchange(state.saving_typing, false))
            ImGui::SetKeyboardFocusHere();
        ImGui::SetNextItemWidth(0.5f * static_cast<float>(state.size_px.x));
        const bool entered = ImGui::InputText("folder", folder_.data(), folder_.size(),
                                              ImGuiInputTextFlags_EnterReturnsTrue);
        note("save/folder");
        if (!state.saving_failed.empty()) {
            ImGui::PushTextWrapPos(0.5f * static_cast<float>(state.size_px.x));
            ImGui::TextColored(
                accent(state), "%s",
                (state.names_hidden ? work.saving().without_names(state.saving_failed)
                                    : state.saving_failed)
                    .c_str());
            ImGui::PopTextWrapPos();
            note("save/failed");
        }
        if (ImGui::Button("save") || entered || state.saving_entered) {
            orders.push_back(order::Save{folder_.data()});
            state.saving_open = false;
        }
        note("save/save");
        ImGui::SameLine();
        if (ImGui::Button("cancel"))
            state.saving_open = false;
        note("save/cancel");
        ImGui::End();
    }
    state.saving_entered = false;
    if (!state.saving_open) {
        folder_ = {};
        state.saving_folder.clear();
        state.saving_failed.clear();
    }
}

void Interface::draw_help(ViewState& state) {
    if (!state.help_open)
        return;
    ImGui::SetNextWindowPos(ImVec2(0.5f * static_cast<float>(state.size_px.x),
                                   0.5f * static_cast<float>(state.size_px.y)),
                            ImGuiCond_Always, ImVec2(0.5f, 0.5f));
    ImGui::Begin("Mouse and keys", &state.help_open,
                 ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings);
    if (ImGui::BeginTable("keys", 2)) {
        for (const KeyHelp& line : key_help()) {
            ImGui::TableNextColumn();
            ImGui::TextColored(accent(state), "%s", line.keys.c_str());
            ImGui::TableNextColumn();
            ImGui::TextUnformatted(line.purpose.c_str());
        }
        ImGui::EndTable();
    }
    ImGui::End();
}

} // namespace palpate::view
