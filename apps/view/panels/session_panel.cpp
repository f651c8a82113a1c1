// Recording of what a person does, and playing it again.

#include <imgui/imgui.h>

#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

void draw_session_panel(Widgets& ui, TypedText& file, ViewState& state) {
    const bool records = !state.scripts.recording.empty();
    name_file(ui, "session/file", file, "session.jsonl", records ? "stop" : "record", state);
    ImGui::SameLine();
    if (records)
        ui.button("stop", "session/stop", order::StopScript{});
    else
        ui.button("record", "session/record", order::RecordScript{file.data()});
    constexpr std::pair<const char*, double> speeds[] = {
        {"as recorded", 1.0}, {"2 times as fast", 2.0}, {"4 times as fast", 4.0}, {"at once", 1e3}};
    ImGui::BeginDisabled(records);
    ui.button("play", "session/play", order::PlayScript{file.data(), state.play_speed});
    ImGui::EndDisabled();
    ImGui::SameLine();
    ImGui::SetNextItemWidth(-1.0f);
    choose(ui, "session/speed", "##speed", state.play_speed, speeds);
    hint(records ? "what you do is written until `stop`"
                 : "a press or a key ends what is played, and the window is yours");
}

} // namespace palpate::view
