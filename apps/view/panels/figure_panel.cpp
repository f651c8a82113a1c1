// A picture of one view for print.

#include <imgui/imgui.h>

#include <algorithm>

#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

namespace {

// How long a single picture has been drawn: nobody knows its share.
std::string drawing_text(Widgets& ui, const std::string& id) {
    return fmt::format("drawing the figure, {:.0f} s ..", ui.seconds_since_begun(id));
}

} // namespace

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
    ImGui::BeginDisabled(figure.panel != Panel::volume); // slices do not turn; rows stay in place
    if (ImGui::InputInt(named("turntable").c_str(), &figure.pictures))
        figure.pictures = std::clamp(figure.pictures, 1, FigureSetup::kMostPictures);
    if (ImGui::IsItemHovered(ImGuiHoveredFlags_AllowWhenDisabled))
        ImGui::SetTooltip("%s",
                          "pictures of a camera that goes round once in 3D, numbered or as an .mp4;"
                          " 1: the view as it is");
    ui.note("figure/pictures");
    ImGui::EndDisabled();
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
    if (figure.share) {
        ImGui::AlignTextToFramePadding();
        ImGui::TextUnformatted(drawing_text(ui, "figure/drawing").c_str());
        ui.note("figure/drawing");
        return;
    }
    name_file(ui, "figure/file", file, "figure.png", "write", state);
    ImGui::SameLine();
    ui.button("write", "figure/write", order::PrintFigure{file.data()});
    draw_result(ui, "figure/result", figure.told, state);
}

} // namespace palpate::view
