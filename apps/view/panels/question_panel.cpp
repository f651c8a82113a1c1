// Questions to a person: whether edits are saved, whether recovered steps are wanted, and where to
// save.

#include <imgui/imgui.h>

#include <algorithm>
#include <filesystem>

#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

namespace {

// A label map, or one image of many.
void draw_file_question(Widgets& ui, ViewState& state, const Work& work) {
    const FileQuestion asked = *state.file_question;
    const bool is_map = asked.about == FileQuestion::About::label_map;
    const auto name = [&](const std::string& text) {
        return state.names_hidden ? std::string("the volume") : text;
    };
    bool open = true;
    begin_dialog(is_map ? "This file holds labels" : "One image of several", &open, state);
    if (is_map) {
        ImGui::TextUnformatted(fmt::format("They lie where {} lies.", name(work.title())).c_str());
        if (asked.replaces)
            ImGui::TextUnformatted(
                "They take the place of the labels that are there; undo brings "
                "these back.");
        if (ui.primary("lay over", "question/over", state)) {
            ui.order(order::OpenLabels{asked.path});
            open = false;
        }
        ImGui::SameLine();
        ui.button("open instead", "question/instead", order::OpenRead{});
    } else {
        ImGui::TextUnformatted(
            fmt::format("This file is one of {} images in its folder.", asked.images).c_str());
        if (ui.primary("open the series", "question/series", state)) {
            ui.order(order::Open{asked.path});
            open = false;
        }
        ImGui::SameLine();
        open &= !ImGui::Button("this image only");
        ui.note("question/one");
    }
    if (is_map) {
        ImGui::SameLine();
        open &= !ImGui::Button("cancel");
        ui.note("question/cancel");
    }
    ImGui::End();
    if (!open)
        state.file_question.reset();
}

// Whether a file may hold labels, by its name: no folder, scene, project or picture does.
bool may_hold_labels(const std::filesystem::path& path) {
    std::error_code ignored;
    return !path.empty() && !is_synthetic(path.string()) && may_be_opened(path.filename()) &&
           !path.extension().string().starts_with(".json") &&
           !std::filesystem::is_directory(path, ignored);
}

} // namespace

void draw_questions(Widgets& ui, TypedText& folder, ViewState& state, Work& work) {
    if (state.file_question && !state.leaving)
        draw_file_question(ui, state, work);
    if (state.leaving && !state.leaving->saving) {
        bool open = true;
        begin_dialog("Edits are not saved", &open, state);
        const std::string next = state.leaving->closes ? "the window closes"
                                 : state.names_hidden  ? "another file opens"
                                                       : state.leaving->path + " opens";
        ImGui::TextUnformatted(fmt::format("Save them before {}?", next).c_str());
        const bool pulled = work.mesh_pulling().is_pulled();
        if (pulled)
            ImGui::TextUnformatted(fmt::format("The pulled mesh is put into label {} first.",
                                               work.mesh_pulling().mesh()->label())
                                       .c_str());
        if (ui.primary("save", "leave/save", state)) {
            state.leaving->saving = true;
            state.leaving->applying = pulled;
            ui.order(pulled ? Order(order::ApplyMesh{}) : order::Save{});
        }
        ImGui::SameLine();
        ui.button("discard", "leave/discard", order::Leave{});
        if (!state.leaving->closes &&
            may_hold_labels(state.leaving->path)) { // nothing is lost then
            ImGui::SameLine();
            if (ui.button("lay over as labels", "leave/over",
                          order::OpenLabels{state.leaving->path}))
                open = false;
        }
        ImGui::SameLine();
        open &= !ImGui::Button("cancel");
        ui.note("leave/cancel");
        ImGui::End();
        if (!open)
            state.leaving.reset();
    }
    if (state.recovered_steps > 0 && !state.leaving && state.opening.empty()) {
        bool open = true;
        begin_dialog("Steps were recovered", &open, state);
        const size_t steps = state.recovered_steps;
        ImGui::TextUnformatted(fmt::format("{} step{} of a window that ended before {} saved.",
                                           steps, steps == 1 ? "" : "s",
                                           steps == 1 ? "it was" : "they were")
                                   .c_str());
        open &= !ui.primary("keep", "recovered/keep", state);
        ImGui::SameLine();
        if (ImGui::Button("undo them")) {
            for (size_t i = 0; i < steps; ++i)
                ui.order(order::Undo{});
            open = false;
        }
        ui.note("recovered/undo");
        ImGui::End();
        if (!open)
            state.recovered_steps = 0;
    }
    if (state.saving_open) {
        begin_dialog("Save to a new project folder", &state.saving_open, state);
        if (folder[0] == '\0') {
            const std::string offered = state.saving_folder.empty()
                                            ? work.saving().new_folder(state.names_hidden)
                                            : state.saving_folder;
            std::copy_n(offered.begin(), std::min(offered.size(), folder.size() - 1),
                        folder.begin());
            state.saving_typing = true;
        }
        if (std::exchange(state.saving_typing, false))
            ImGui::SetKeyboardFocusHere();
        if (ui.named.first == "save/folder" && !state.browser_open)
            type(folder, std::exchange(ui.named, {}).second);
        ImGui::SetNextItemWidth(0.5f * static_cast<float>(state.size_px.x));
        const bool entered = ImGui::InputText("##folder", folder.data(), folder.size(),
                                              ImGuiInputTextFlags_EnterReturnsTrue);
        ui.note("save/folder");
        ImGui::SameLine();
        if (ImGui::Button(".."))
            browse_for_name(ui, "save/folder", folder.data(), state);
        ui.note("save/folder/choose");
        if (!state.saving_failed.empty()) {
            ImGui::PushTextWrapPos(0.5f * static_cast<float>(state.size_px.x));
            ImGui::TextColored(accent(state), "%s",
                               state.saving_failed.shown(state.names_hidden).c_str());
            ImGui::PopTextWrapPos();
            ui.note("save/failed");
        }
        if (ui.primary("save", "save/save", state) || entered || state.saving_entered) {
            ui.order(order::Save{folder.data()});
            state.saving_open = false;
        }
        ImGui::SameLine();
        if (ImGui::Button("cancel"))
            state.saving_open = false;
        ui.note("save/cancel");
        ImGui::End();
    }
    state.saving_entered = false;
    if (!state.saving_open) {
        folder = {};
        state.saving_folder.clear();
        state.saving_failed = {};
    }
}

} // namespace palpate::view
