// The search box.

#include <imgui/imgui.h>

#include <algorithm>

#include "apps/view/panels/panels.h"
#include "apps/view/panels/search.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

namespace {

constexpr size_t kMostFound = 10; // seen at once

void take_found(Widgets& ui, ViewState& state, const Subject& subject, const Findable& one) {
    state.search_open = false;
    Outcome next{std::move(state)};
    one.choose(next, subject);
    state = std::move(next.state);
    for (Order& order : next.orders)
        ui.order(std::move(order));
    ui.pointed_out = one.widget;
    ui.scrolls_to = true;
}

} // namespace

void draw_search(Widgets& ui, SearchBox& box, ViewState& state, Work& work) {
    if (!state.search_open) {
        box = {};
        return;
    }
    const bool opens = !std::exchange(box.was_open, true);
    const float letter = ImGui::GetFontSize();
    const float width =
        std::min(32.0f * letter, static_cast<float>(state.size_px.x) - 2.0f * letter);
    ImGui::SetNextWindowPos(ImVec2(0.5f * static_cast<float>(state.size_px.x), 2.0f * letter),
                            ImGuiCond_Always, ImVec2(0.5f, 0.0f));
    ImGui::SetNextWindowSize(ImVec2(width, 0.0f));
    ImGui::Begin("search", nullptr,
                 ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_AlwaysAutoResize);
    if (opens) {
        ImGui::SetWindowFocus();
        ImGui::SetKeyboardFocusHere();
    }
    ImGui::SetNextItemWidth(-1.0f);
    bool entered =
        ImGui::InputTextWithHint("##text", "find a tool, a command or a setting", box.typed.data(),
                                 box.typed.size(), ImGuiInputTextFlags_EnterReturnsTrue);
    if (ImGui::IsItemEdited())
        box.row = 0;
    ui.note("search/text");
    const auto pressed = [](ImGuiKey key) { return ImGui::IsKeyPressed(ImGui::GetKeyIndex(key)); };
    const std::vector<Findable> all =
        findables(work.subject(), haptics::find_algorithm(work.hand().touch().options().algorithm));
    std::vector<size_t> places = found(all, box.typed.data());
    if (pressed(ImGuiKey_DownArrow))
        ++box.row;
    if (pressed(ImGuiKey_UpArrow) && box.row > 0)
        --box.row;
    box.row = std::min(box.row, places.empty() ? 0 : places.size() - 1);
    const size_t first = box.row < kMostFound ? 0 : box.row - kMostFound + 1;
    std::optional<size_t> chosen;
    if (entered && !places.empty())
        chosen = places[box.row];
    const float room = ImGui::GetContentRegionAvail().x;
    const ImVec4 second = rgb_color(theme_of(state.light).second); // seen on a chosen row, too
    for (size_t row = first; row < std::min(places.size(), first + kMostFound); ++row) {
        const Findable& one = all[places[row]];
        ImGui::PushID(static_cast<int>(places[row]));
        if (ImGui::Selectable(fitted(one.title, 0.62f * room).c_str(), row == box.row))
            chosen = places[row];
        ui.note(fmt::format("search/row/{}", row));
        if (ImGui::IsItemHovered() && !one.help.empty())
            ImGui::SetTooltip("%s", one.help.c_str());
        ImGui::SameLine(0.66f * room);
        ImGui::TextColored(second, "%s", one.kind.c_str());
        if (!one.keys.empty()) {
            ImGui::SameLine(room - ImGui::CalcTextSize(one.keys.c_str()).x);
            ImGui::TextColored(second, "%s", one.keys.c_str());
        }
        ImGui::PopID();
    }
    if (places.empty())
        hint("nothing has these words");
    else if (const Findable& one = all[places[box.row]]; !one.help.empty())
        hint((one.help +
              (one.kind == "setting" ? " (Enter shows it, and once more presses it)" : ""))
                 .c_str());
    ImGui::End();
    if (pressed(ImGuiKey_Escape))
        state.search_open = false;
    else if (chosen)
        take_found(ui, state, work.subject(), all[*chosen]);
}

} // namespace palpate::view
