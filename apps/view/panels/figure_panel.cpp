// A picture of one view for print.

#include <imgui/imgui.h>

#include <algorithm>

#include "apps/view/panels/interface.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

void Interface::draw_figure_panel(ViewState& state, std::vector<Order>& orders) {
    FigureSetup& figure = state.figure;
    choose<Panel>("of", figure.panel,
                  {{"3D", Panel::volume},
                   {"axial", Panel::axial},
                   {"coronal", Panel::coronal},
                   {"sagittal", Panel::sagittal}});
    note("figure/panel");
    if (ImGui::InputInt2("pixels", &figure.size_px.x))
        figure.size_px = glm::clamp(figure.size_px, 16, FigureSetup::kMost_px);
    note("figure/size");
    if (figure.panel == Panel::volume) {
        if (ImGui::InputInt("round in", &figure.pictures))
            figure.pictures = std::clamp(figure.pictures, 1, FigureSetup::kMostPictures);
        if (ImGui::IsItemHovered())
            ImGui::SetTooltip("%s",
                              "pictures of a camera that goes round once, numbered or as an .mp4;"
                              " 1: the view as it is");
        note("figure/pictures");
    }
    choose("background", figure.paper, kPapers);
    note("figure/paper");
    const auto mark = [&](const char* name, const char* id, bool& shown) {
        ImGui::Checkbox(name, &shown);
        note(id);
    };
    mark("letters", "figure/letters", figure.letters);
    ImGui::SameLine(0.5f * ImGui::GetWindowWidth());
    mark("scale bar", "figure/scale_bar", figure.scale_bar);
    mark("note", "figure/note", figure.note);
    ImGui::SameLine(0.5f * ImGui::GetWindowWidth());
    mark("colour bar", "figure/color_bar", figure.color_bar);
    if (figure_file_[0] == '\0')
        std::string("figure.png").copy(figure_file_.data(), figure_file_.size() - 1);
    if (figure.share && figure.pictures > 1) {
        ImGui::ProgressBar(static_cast<float>(*figure.share),
                           ImVec2(-ImGui::CalcTextSize("cancel__").x, 0.0f));
        ImGui::SameLine();
        if (ImGui::Button("cancel"))
            orders.push_back(order::StopFigure{});
        note("figure/cancel");
        return;
    }
    ImGui::SetNextItemWidth(-ImGui::CalcTextSize("write__").x);
    ImGui::InputText("##figure", figure_file_.data(), figure_file_.size());
    note("figure/file");
    ImGui::SameLine();
    if (ImGui::Button("write"))
        orders.push_back(order::PrintFigure{figure_file_.data()});
    note("figure/write");
}

} // namespace palpate::view
