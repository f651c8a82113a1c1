// A picture of one view for print.

#include <imgui/imgui.h>

#include <algorithm>

#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

void draw_figure_panel(Widgets& ui, TypedText& file, ViewState& state) {
    FigureSetup& figure = state.figure;
    choose<Panel>(ui, "figure/panel", "of", figure.panel,
                  {{"3D", Panel::volume},
                   {"axial", Panel::axial},
                   {"coronal", Panel::coronal},
                   {"sagittal", Panel::sagittal}});
    if (ImGui::InputInt2(named("pixels").c_str(), &figure.size_px.x))
        figure.size_px = glm::clamp(figure.size_px, 16, FigureSetup::kMost_px);
    ui.note("figure/size");
    if (figure.panel == Panel::volume) {
        if (ImGui::InputInt(named("round in").c_str(), &figure.pictures))
            figure.pictures = std::clamp(figure.pictures, 1, FigureSetup::kMostPictures);
        if (ImGui::IsItemHovered())
            ImGui::SetTooltip("%s",
                              "pictures of a camera that goes round once, numbered or as an .mp4;"
                              " 1: the view as it is");
        ui.note("figure/pictures");
    }
    choose(ui, "figure/paper", "background", figure.paper, kPapers);
    ui.check("letters", "figure/letters", figure.letters);
    ImGui::SameLine(0.5f * ImGui::GetWindowWidth());
    ui.check("scale bar", "figure/scale_bar", figure.scale_bar);
    ui.check("note", "figure/note", figure.note);
    ImGui::SameLine(0.5f * ImGui::GetWindowWidth());
    ui.check("colour bar", "figure/color_bar", figure.color_bar);
    ui.check("legend of labels", "figure/legend", figure.legend);
    if (figure.share && figure.pictures > 1) {
        ui.progress("figure/share", *figure.share, "", "cancel");
        ImGui::SameLine();
        ui.button("cancel", "figure/cancel", order::StopFigure{});
        return;
    }
    name_file(ui, "figure/file", file, "figure.png", "write", state);
    ImGui::SameLine();
    ui.button("write", "figure/write", order::PrintFigure{file.data()});
}

} // namespace palpate::view
