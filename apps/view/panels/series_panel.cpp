// The series of a DICOM folder: a list in the side panel, and a chooser with their pictures.

#include <imgui/imgui.h>

#include "apps/view/panels/interface.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

void Interface::draw_series(ViewState& state, Work& work, std::vector<Order>& orders) {
    const std::vector<SeriesLine>& series = work.series();
    if (series.size() < 2)
        return;
    ImGui::Separator();
    ImGui::TextDisabled("series of this folder");
    ImGui::SameLine();
    if (ImGui::SmallButton("pictures"))
        state.series_open = true;
    note("file/pictures");
    for (const SeriesLine& line : series) {
        ImGui::PushID(static_cast<int>(line.number));
        if (ImGui::Selectable(wrapped(line.shown(state.names_hidden)).c_str(), line.is_open))
            orders.push_back(order::Open{work.path(), std::to_string(line.number)});
        note(fmt::format("file/series/{}", line.number).c_str());
        ImGui::PopID();
    }
}

// A click opens a series. One that is not read has no picture.
void Interface::draw_series_chooser(ViewState& state, Work& work, std::vector<Order>& orders) {
    if (!state.series_open)
        return;
    const std::vector<SeriesLine>& series = work.series();
    const auto scale = static_cast<float>(state.text_scale);
    const ImVec2 window(static_cast<float>(state.size_px.x), static_cast<float>(state.size_px.y));
    ImGui::SetNextWindowPos(ImVec2(0.5f * window.x, 0.5f * window.y), ImGuiCond_Always,
                            ImVec2(0.5f, 0.5f));
    ImGui::SetNextWindowSize(ImVec2(std::min(0.8f * window.x, 560.0f * scale), 0.8f * window.y));
    ImGui::Begin("Series of this folder", &state.series_open,
                 ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                     ImGuiWindowFlags_NoSavedSettings);
    const float side = static_cast<float>(SeriesPreviews::kSide_px) * scale;
    for (size_t i = 0; i < series.size(); ++i) {
        ImGui::PushID(static_cast<int>(i));
        const ImVec2 at = ImGui::GetCursorPos();
        if (ImGui::Selectable("##series", series[i].is_open, 0, ImVec2(0.0f, side)))
            orders.push_back(order::Open{work.path(), std::to_string(series[i].number)});
        note(fmt::format("series/{}", series[i].number).c_str());
        const ImVec2 next = ImGui::GetCursorPos();
        ImGui::SetCursorPos(at);
        using State = SeriesPreviews::State;
        const State is = previews_ ? previews_->state(i) : State::none;
        if (is == State::there) {
            const glm::vec2 all(previews_->size_px()), low(SeriesPreviews::corner_px(i));
            const glm::vec2 from = low / all,
                            to = (low + static_cast<float>(SeriesPreviews::kSide_px)) / all;
            ImGui::Image(reinterpret_cast<ImTextureID>(static_cast<uintptr_t>(kPreviewsTexture)),
                         ImVec2(side, side), ImVec2(from.x, from.y), ImVec2(to.x, to.y));
            note(fmt::format("series/picture/{}", series[i].number).c_str());
        } else {
            ImGui::Dummy(ImVec2(side, side));
            const ImVec2 low = ImGui::GetItemRectMin();
            ImGui::GetWindowDrawList()->AddText(ImVec2(low.x + 4.0f, low.y + 4.0f),
                                                ImGui::GetColorU32(ImGuiCol_TextDisabled),
                                                is == State::waiting ? "reading .." : "no picture");
        }
        ImGui::SameLine();
        ImGui::BeginGroup();
        ImGui::TextUnformatted(wrapped(series[i].shown(state.names_hidden)).c_str());
        if (series[i].is_open)
            ImGui::TextDisabled("open");
        ImGui::EndGroup();
        ImGui::SetCursorPos(next);
        ImGui::PopID();
    }
    ImGui::End();
}

} // namespace palpate::view
