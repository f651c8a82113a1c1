// The series of a DICOM folder: a list in the side panel, and a chooser with their pictures.

#include <imgui/imgui.h>

#include "apps/view/panels/interface.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

void draw_series_list(Widgets& ui, ViewState& state, Work& work) {
    const std::vector<SeriesInfo>& series = work.series();
    if (series.size() < 2)
        return;
    ImGui::Separator();
    ImGui::TextDisabled("series of this folder");
    ImGui::SameLine();
    if (ImGui::SmallButton("pictures"))
        state.series_open = true;
    ui.note("file/pictures");
    for (const SeriesInfo& line : series) {
        ImGui::PushID(static_cast<int>(line.number));
        if (ImGui::Selectable(wrapped(series_text(line, state.names_hidden)).c_str(), line.is_read))
            ui.order(order::Open{work.path(), std::to_string(line.number)});
        ui.note(fmt::format("file/series/{}", line.number));
        ImGui::PopID();
    }
}

// A click opens a series. One that is not read has no picture.
void draw_series_chooser(Widgets& ui, const SeriesPreviews* previews, ViewState& state,
                         Work& work) {
    if (!state.series_open)
        return;
    const std::vector<SeriesInfo>& series = work.series();
    const auto scale = static_cast<float>(state.text_scale);
    const ImVec2 window(static_cast<float>(state.size_px.x), static_cast<float>(state.size_px.y));
    ImGui::SetNextWindowSize(ImVec2(std::min(0.8f * window.x, 560.0f * scale), 0.8f * window.y));
    begin_dialog("Series of this folder", &state.series_open, state, ImGuiWindowFlags_NoResize);
    const float side = static_cast<float>(SeriesPreviews::kSide_px) * scale;
    for (size_t i = 0; i < series.size(); ++i) {
        ImGui::PushID(static_cast<int>(i));
        const ImVec2 at = ImGui::GetCursorPos();
        if (ImGui::Selectable("##series", series[i].is_read, 0, ImVec2(0.0f, side)))
            ui.order(order::Open{work.path(), std::to_string(series[i].number)});
        ui.note(fmt::format("series/{}", series[i].number));
        const ImVec2 next = ImGui::GetCursorPos();
        ImGui::SetCursorPos(at);
        using State = SeriesPreviews::State;
        const State is = previews ? previews->state(i) : State::none;
        if (is == State::there) {
            const glm::vec2 all(previews->size_px()), low(SeriesPreviews::corner_px(i));
            const glm::vec2 from = low / all,
                            to = (low + static_cast<float>(SeriesPreviews::kSide_px)) / all;
            ImGui::Image(
                reinterpret_cast<ImTextureID>(static_cast<uintptr_t>(Interface::kPreviewsTexture)),
                ImVec2(side, side), ImVec2(from.x, from.y), ImVec2(to.x, to.y));
            ui.note(fmt::format("series/picture/{}", series[i].number));
        } else {
            ImGui::Dummy(ImVec2(side, side));
            const ImVec2 low = ImGui::GetItemRectMin();
            ImGui::GetWindowDrawList()->AddText(ImVec2(low.x + 4.0f, low.y + 4.0f),
                                                ImGui::GetColorU32(ImGuiCol_TextDisabled),
                                                is == State::waiting ? "reading .." : "no picture");
        }
        ImGui::SameLine();
        ImGui::BeginGroup();
        ImGui::TextUnformatted(wrapped(series_text(series[i], state.names_hidden)).c_str());
        if (series[i].is_read)
            ImGui::TextDisabled("open");
        ImGui::EndGroup();
        ImGui::SetCursorPos(next);
        ImGui::PopID();
    }
    ImGui::End();
}

} // namespace palpate::view
