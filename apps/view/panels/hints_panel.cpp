// Four hints at the first start: each goes when it is followed, and all when a person closes them.

#include <imgui/imgui.h>

#include <algorithm>

#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

namespace {

constexpr struct {
    const char *title, *text;
} kHints[] = {
    {"Slices", "turn the wheel for the next slice; drag to move the crosshair"},
    {"Tools", "the bar at the left: draw, erase, cut, measure"},
    {"Ctrl+K", "finds each tool and setting by its name"},
    {"Tasks", "the words at the top choose what the panel shows"},
};
static_assert(std::size(kHints) == std::tuple_size_v<decltype(Hints::followed)>);

// Notes what a person has done since the last frame.
void follow(HintsPanel& panel, ViewState& state, bool has_paged) {
    Hints& hints = state.hints;
    const bool is_first = !std::exchange(panel.was_open, true);
    hints.followed[0] |= has_paged;
    hints.followed[1] |= !is_first && panel.tool != state.tool;
    hints.followed[2] |= state.search_open;
    hints.followed[3] |= !is_first && panel.task != state.task;
    panel.tool = state.tool;
    panel.task = state.task;
    if (std::all_of(hints.followed.begin(), hints.followed.end(), [](bool one) { return one; }))
        hints.open = false;
}

} // namespace

void draw_hints(Widgets& ui, HintsPanel& panel, ViewState& state, bool has_paged) {
    Hints& hints = state.hints;
    if (!hints.open) {
        panel.was_open = false;
        return;
    }
    follow(panel, state, has_paged);
    hints.seen = !hints.open;
    if (state.welcome_open || state.browser_open || hints.seen)
        return;
    const Theme& theme = theme_of(state.light);
    const auto scale = static_cast<float>(state.text_scale);
    const Places places = places_of(state);
    glm::ivec2 low(places.views.front().box.low_px), high(low);
    for (const Places::View& view : places.views)
        high = glm::max(high, view.box.low_px + view.box.size_px);
    const float title = 64.0f * scale;
    ImGui::SetNextWindowPos(
        {0.5f * static_cast<float>(low.x + high.x), static_cast<float>(high.y) - 12.0f * scale},
        ImGuiCond_Always, {0.5f, 1.0f});
    ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 1.0f);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 6.0f * scale);
    ImGui::PushStyleColor(ImGuiCol_Border, rgb_color(theme.accent));
    ImGui::Begin("hints", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize |
                     ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                     ImGuiWindowFlags_NoFocusOnAppearing);
    for (size_t i = 0; i < std::size(kHints); ++i) {
        if (hints.followed[i])
            continue;
        ImGui::PushFont(bold_letters());
        ImGui::TextUnformatted(kHints[i].title);
        ImGui::PopFont();
        ImGui::SameLine(title + ImGui::GetStyle().WindowPadding.x);
        ImGui::TextUnformatted(kHints[i].text);
    }
    if (ImGui::SmallButton("close hints"))
        hints = {.open = false, .seen = true, .followed = {}};
    ui.note("hints/close");
    ImGui::End();
    ImGui::PopStyleColor();
    ImGui::PopStyleVar(2);
}

} // namespace palpate::view
