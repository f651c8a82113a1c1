// The material that tools have taken away: in all, and of each label.

#include <imgui/imgui.h>

#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

void draw_removed_panel(Widgets& ui, Work& work) {
    const std::optional<RemovedMaterial::Amounts> removed = work.removed().now();
    if (!removed)
        return hint("removed: its samples cannot be read");
    const auto ml = [](double mm3) { return fmt::format("{:.3f} ml", 1e-3 * mm3); };
    ImGui::TextWrapped("%s, solid from %.5g on", ml(removed->all_mm3).c_str(), removed->solid_from);
    ui.note("removed/all");
    ui.button("reset", "removed/reset", order::ResetRemoved{});
    const bool by_label = !removed->by_label_mm3.empty() &&
                          (removed->by_label_mm3.size() > 1 || removed->by_label_mm3[0].first != 0);
    if (!by_label || !ImGui::BeginTable("removed", 2, ImGuiTableFlags_SizingStretchProp))
        return;
    for (const auto& [label, mm3] : removed->by_label_mm3) {
        ImGui::TableNextRow();
        ImGui::TableNextColumn();
        ImGui::TextUnformatted(
            label == 0 ? "no label" : fmt::format("label {}", work.name_of_label(label)).c_str());
        ImGui::TableNextColumn();
        ImGui::TextUnformatted(ml(mm3).c_str());
    }
    ImGui::EndTable();
}

} // namespace palpate::view
