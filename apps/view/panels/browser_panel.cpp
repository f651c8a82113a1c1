// The browser of files, and what is being opened.

#include <imgui/imgui.h>

#include <algorithm>
#include <filesystem>

#include "apps/view/panels/panels.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {

namespace fs = std::filesystem;

namespace {

std::string size_text(uint64_t bytes) {
    const auto b = static_cast<double>(bytes);
    return b < 1e3   ? fmt::format("{} B", bytes)
           : b < 1e6 ? fmt::format("{:.0f} kB", b / 1e3)
           : b < 1e9 ? fmt::format("{:.1f} MB", b / 1e6)
                     : fmt::format("{:.1f} GB", b / 1e9);
}

void browse(Browser& panel, const fs::path& folder) {
    Result<std::vector<BrowserEntry>> list = list_folder(folder);
    panel.error = list ? "" : list.error().message;
    if (!list && !panel.folder.empty())
        return; // stay where it can be read
    panel.folder = folder.string();
    panel.entries = list ? std::move(*list) : std::vector<BrowserEntry>{};
    panel.typed = {};
    panel.folder.copy(panel.typed.data(), panel.typed.size() - 1);
}

} // namespace

void draw_browser(Widgets& ui, Browser& panel, ViewState& state) {
    const bool begins = !std::exchange(panel.was_open, state.browser_open);
    if (!state.browser_open)
        return;
    if (begins || panel.folder.empty()) // as it is now
        browse(panel, panel.folder.empty() ? fs::current_path() : fs::path(panel.folder));
    const ImVec2 size(std::min(0.7f * static_cast<float>(state.size_px.x),
                               620.0f * static_cast<float>(state.text_scale)),
                      0.75f * static_cast<float>(state.size_px.y));
    ImGui::SetNextWindowSize(size);
    const bool labels = state.browsing == Browsing::labels,
               fused = state.browsing == Browsing::fused;
    const auto open = [&](std::string path) {
        if (labels)
            ui.order(order::OpenLabels{std::move(path)});
        else if (fused)
            ui.order(order::OpenFused{std::move(path)});
        else
            ui.order(order::Open{std::move(path)});
        state.browser_open = false;
    };
    const char* title = labels  ? "Labels of this volume"
                        : fused ? "A volume over the slices of this one"
                                : "Open a volume, a scene or a project";
    begin_dialog(title, &state.browser_open, state, ImGuiWindowFlags_NoResize);
    if (ImGui::Button("up"))
        browse(panel, fs::path(panel.folder).parent_path());
    ui.note("browser/up");
    ImGui::SameLine();
    if (const char* home = std::getenv("HOME"); home && ImGui::Button("home"))
        browse(panel, home);
    ImGui::SameLine();
    if (ImGui::Button("open this folder")) // of DICOM files or slices, or a project
        open(panel.folder);
    ui.note("browser/folder");
    ImGui::SetNextItemWidth(-1.0f);
    if (ImGui::InputText("##path", panel.typed.data(), panel.typed.size(),
                         ImGuiInputTextFlags_EnterReturnsTrue)) {
        std::error_code ignored;
        if (fs::is_directory(panel.typed.data(), ignored))
            browse(panel, panel.typed.data());
        else
            open(panel.typed.data());
    }
    ui.note("browser/path");
    if (!panel.error.empty())
        ImGui::TextColored(ImVec4(1.0f, 0.6f, 0.3f, 1.0f), "%s", panel.error.c_str());
    if (ImGui::BeginChild("entries", ImVec2(0.0f, 0.0f), true)) {
        fs::path next;
        ImGuiListClipper rows;
        rows.Begin(static_cast<int>(panel.entries.size()));
        while (rows.Step())
            for (int i = rows.DisplayStart; i < rows.DisplayEnd; ++i) {
                const BrowserEntry& entry = panel.entries[static_cast<size_t>(i)];
                const std::string name = entry.is_folder ? entry.name + "/" : entry.name;
                const std::string bytes = entry.is_folder ? "" : size_text(entry.bytes);
                const float bytes_at =
                    ImGui::GetWindowContentRegionMax().x - ImGui::CalcTextSize(bytes.c_str()).x;
                const float gap = bytes.empty() ? 0.0f : ImGui::CalcTextSize("  ").x;
                const std::string shown = fitted(name, bytes_at - gap - ImGui::GetCursorPosX());
                ImGui::PushID(i);
                const bool chosen = ImGui::Selectable(shown.c_str());
                if (shown != name && ImGui::IsItemHovered())
                    ImGui::SetTooltip("%s", name.c_str());
                if (chosen) {
                    const fs::path path = fs::path(panel.folder) / entry.name;
                    if (entry.is_folder && !Project::is_one(path))
                        next = path;
                    else
                        open(path.string());
                }
                ui.note(fmt::format("browser/{}", entry.name));
                if (!bytes.empty()) {
                    ImGui::SameLine(bytes_at);
                    ImGui::TextDisabled("%s", bytes.c_str());
                }
                ImGui::PopID();
            }
        if (!next.empty())
            browse(panel, next);
    }
    ImGui::EndChild();
    ImGui::End();
}

// While a file is read.
void draw_opening(Widgets& ui, const ViewState& state) {
    if (state.opening.empty())
        return;
    begin_dialog("Opening", nullptr, state);
    if (!state.names_hidden)
        ImGui::TextUnformatted(state.opening.c_str());
    const double seconds = std::max(0.0, ui.time_s - state.opening_since_s);
    const std::string shown = state.opening_share > 0.0
                                  ? fmt::format("{:.0f} %", 100.0 * state.opening_share)
                                  : fmt::format("{:.0f} s", seconds);
    ImGui::ProgressBar(static_cast<float>(state.opening_share),
                       ImVec2(18.0f * ImGui::GetFontSize(), 0.0f), shown.c_str());
    ui.note("opening/share");
    ui.button("cancel", "opening/cancel", order::CancelOpening{});
    ImGui::End();
}

} // namespace palpate::view
