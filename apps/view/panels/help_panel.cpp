// The page of keys.

#include <imgui/imgui.h>

#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"
#include "apps/view/window/keys.h"

namespace palpate::view {

void draw_help(ViewState& state) {
    if (!state.help_open)
        return;
    begin_dialog("Mouse and keys", &state.help_open, state);
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
