// The window without a file: open, drop, what was opened last, and examples.

#include <imgui/imgui.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "apps/view/panels/interface.h"
#include "apps/view/panels/welcome.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

namespace {

// The item's picture in a box, or an empty box.
void draw_picture(const SeriesPreviews* pictures, size_t i, ImVec2 low, ImVec2 high) {
    ImDrawList& list = *ImGui::GetWindowDrawList();
    const float rounding = ImGui::GetStyle().FrameRounding;
    if (!pictures || pictures->state(i) != SeriesPreviews::State::there)
        return list.AddRectFilled(low, high, ImGui::GetColorU32(ImGuiCol_FrameBg), rounding);
    const glm::vec2 all(pictures->size_px()), corner(SeriesPreviews::corner_px(i));
    const glm::vec2 from = corner / all,
                    to = (corner + static_cast<float>(SeriesPreviews::kSide_px)) / all;
    list.AddImageRounded(
        reinterpret_cast<ImTextureID>(static_cast<uintptr_t>(Interface::kWelcomeTexture)), low,
        high, {from.x, from.y}, {to.x, to.y}, IM_COL32_WHITE, rounding);
}

// A picture, and below it a title and a line of what it is. Whether it was pressed.
bool draw_tile(Widgets& ui, const Welcome& welcome, size_t i, const std::string& id, float side,
               const Theme& theme) {
    const WelcomeItem& item = welcome.items[i];
    const float line = ImGui::GetTextLineHeight();
    const ImVec2 low = ImGui::GetCursorScreenPos(), high(low.x + side, low.y + side);
    const bool pressed = ImGui::InvisibleButton(id.c_str(), {side, side + 2.0f * line + 4.0f});
    ui.note(id);
    const bool is_under = ImGui::IsItemHovered();
    draw_picture(welcome.pictures.get(), i, low, high);
    ImDrawList& list = *ImGui::GetWindowDrawList();
    list.AddRect(low, high, ImGui::GetColorU32(rgb_color(is_under ? theme.accent : theme.rim)),
                 ImGui::GetStyle().FrameRounding, 0, is_under ? 2.0f : 1.0f);
    list.AddText({low.x, high.y + 4.0f},
                 ImGui::GetColorU32(rgb_color(is_under ? theme.accent_text : theme.text)),
                 fitted(item.title, side).c_str());
    list.AddText({low.x, high.y + 4.0f + line}, ImGui::GetColorU32(rgb_color(theme.hint)),
                 fitted(item.note, side).c_str());
    if (is_under)
        ImGui::SetTooltip("%s", item.is_example ? item.note.c_str() : item.path.c_str());
    return pressed;
}

} // namespace

std::vector<WelcomeItem> welcome_items(const std::vector<std::string>& recent) {
    std::vector<WelcomeItem> items;
    for (const std::string& path : recent) {
        if (items.size() == kMostWelcomed)
            break;
        const std::filesystem::path whole(path);
        const std::filesystem::path named = whole.has_filename() ? whole : whole.parent_path();
        items.push_back({path, named.filename(), named.parent_path().filename()});
    }
    items.push_back({"synthetic:phantom?size=96", "head", "skull and brain", true});
    items.push_back({"synthetic:gyroid?size=96", "lattice", "spongy", true});
    items.push_back({"synthetic:ball?size=96", "ball", "70 mm across", true});
    return items;
}

void draw_welcome(Widgets& ui, const Welcome* welcome, ViewState& state) {
    if (!state.welcome_open || state.browser_open || !state.opening.empty() || !welcome)
        return;
    const Theme& theme = theme_of(state.light);
    const auto scale = static_cast<float>(state.text_scale);
    const auto window = static_cast<float>(state.size_px.x);
    const float gap = ImGui::GetStyle().ItemSpacing.x;
    const float side = std::floor(
        std::min(static_cast<float>(SeriesPreviews::kSide_px) * scale,
                 (0.9f * window - static_cast<float>(kMostWelcomed) * gap) / kMostWelcomed));
    begin_dialog("Open a volume", &state.welcome_open, state);
    if (ui.primary("open a file or a folder ..", "welcome/open", state)) {
        state.browser_open = true;
        state.browsing = Browsing::documents;
    }
    hint("or drop it on this window: NIfTI, NRRD, MetaImage, a folder of DICOM files, a project");
    const auto draw_row = [&](const char* title, bool examples) {
        size_t drawn = 0;
        for (size_t i = 0; i < welcome->items.size(); ++i) {
            if (welcome->items[i].is_example != examples)
                continue;
            if (drawn == 0) {
                const float height = std::round(1.5f * ImGui::GetTextLineHeight());
                const ImVec2 at = ImGui::GetCursorScreenPos();
                draw_spaced(*ImGui::GetWindowDrawList(), {at.x, at.y + 0.5f * height}, title,
                            ImGui::GetColorU32(rgb_color(theme.hint)));
                ImGui::Dummy({1.0f, height});
            } else {
                ImGui::SameLine(0.0f, gap);
            }
            const std::string id =
                fmt::format("welcome/{}/{}", examples ? "example" : "recent", drawn++);
            if (draw_tile(ui, *welcome, i, id, side, theme))
                ui.order(order::Open{welcome->items[i].path});
        }
    };
    if (!state.names_hidden)
        draw_row("opened last", false);
    draw_row("examples", true);
    ImGui::End();
}

} // namespace palpate::view
