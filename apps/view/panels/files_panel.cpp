// Files: what was opened last, a browser, what is being opened; looks; the steps that were done.

#include <imgui/imgui.h>

#include <algorithm>
#include <filesystem>

#include "apps/view/panels/file_browser.h"
#include "apps/view/panels/interface.h"
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

} // namespace

void Interface::draw_files_panel(ViewState& state, Work& work, std::vector<Order>& orders) {
    if (ImGui::Button("open..")) {
        state.browser_open = true;
        state.browsing = Browsing::documents;
    }
    note("file/open");
    ImGui::SameLine();
    if (ImGui::Button("save"))
        orders.push_back(order::Save{});
    note("file/save");
    ImGui::SameLine();
    if (ImGui::Button("picture"))
        orders.push_back(order::TakePicture{});
    note("file/picture");
    ImGui::Checkbox("hide names", &state.names_hidden);
    note("file/hide");
    if (!state.names_hidden && !recent_.empty()) {
        ImGui::TextDisabled("opened last");
        for (size_t i = 0; i < recent_.size(); ++i) {
            ImGui::PushID(static_cast<int>(i));
            const fs::path path(recent_[i]);
            const std::string name = (path.has_filename() ? path : path.parent_path()).filename();
            if (ImGui::Selectable(name.c_str()))
                orders.push_back(order::Open{recent_[i]});
            if (ImGui::IsItemHovered())
                ImGui::SetTooltip("%s", recent_[i].c_str());
            note(fmt::format("file/recent/{}", i).c_str());
            ImGui::PopID();
        }
    }
    draw_series(state, work, orders);
    if (ImGui::CollapsingHeader("Figure"))
        draw_figure_panel(state, orders);
    note("file/figure");
    ImGui::Separator();
    ImGui::Checkbox("light", &state.light);
    note("file/light");
    ImGui::SameLine();
    constexpr double scales[] = {1.0, 1.25, 1.5, 2.0};
    ImGui::SetNextItemWidth(5.0f * ImGui::GetFontSize());
    if (ImGui::BeginCombo("text", fmt::format("{:g}", state.text_scale).c_str())) {
        for (const double scale : scales) {
            if (ImGui::Selectable(fmt::format("{:g}", scale).c_str(), state.text_scale == scale))
                state.text_scale = scale;
            note(fmt::format("file/text/{:g}", scale).c_str());
        }
        ImGui::EndCombo();
    }
    note("file/text");
    ImGui::Separator();
    draw_history(work, orders);
}

// Steps that were done, and below the present, dimmed, those that can be redone. A click goes
// there.
void Interface::draw_history(Work& work, std::vector<Order>& orders) {
    const EditState edit = work.edited();
    const std::vector<std::string> titles = work.session().step_titles();
    ImGui::TextDisabled("steps");
    const float row = ImGui::GetTextLineHeightWithSpacing();
    if (!ImGui::BeginChild("steps",
                           ImVec2(0.0f, std::max(ImGui::GetContentRegionAvail().y, 4 * row))))
        return ImGui::EndChild();
    const auto line = [&](size_t done, const std::string& title) {
        ImGui::PushID(static_cast<int>(done));
        const bool is_redo = done > edit.undo_steps;
        if (is_redo)
            ImGui::PushStyleColor(ImGuiCol_Text, ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled));
        if (ImGui::Selectable(title.c_str(), done == edit.undo_steps)) {
            for (size_t i = done; i < edit.undo_steps; ++i)
                orders.push_back(order::Undo{});
            for (size_t i = edit.undo_steps; i < done; ++i)
                orders.push_back(order::Redo{});
        }
        note(fmt::format("file/step/{}", done).c_str());
        if (is_redo)
            ImGui::PopStyleColor();
        ImGui::PopID();
    };
    line(0, "as opened");
    for (size_t i = 0; i < titles.size(); ++i)
        line(i + 1, fmt::format("{}  {}", i + 1, titles[i]));
    ImGui::EndChild();
}

void Interface::draw_browser(ViewState& state, std::vector<Order>& orders) {
    const bool begins = !std::exchange(browser_was_open_, state.browser_open);
    if (!state.browser_open)
        return;
    if (begins || browsed_.empty()) // as it is now
        browse(browsed_.empty() ? fs::current_path() : fs::path(browsed_));
    const ImVec2 size(std::min(0.7f * static_cast<float>(state.size_px.x),
                               620.0f * static_cast<float>(state.text_scale)),
                      0.75f * static_cast<float>(state.size_px.y));
    ImGui::SetNextWindowPos(ImVec2(0.5f * static_cast<float>(state.size_px.x),
                                   0.5f * static_cast<float>(state.size_px.y)),
                            ImGuiCond_Always, ImVec2(0.5f, 0.5f));
    ImGui::SetNextWindowSize(size);
    const bool labels = state.browsing == Browsing::labels,
               fused = state.browsing == Browsing::fused;
    const auto open = [&](std::string path) {
        if (labels)
            orders.push_back(order::OpenLabels{std::move(path)});
        else if (fused)
            orders.push_back(order::OpenFused{std::move(path)});
        else
            orders.push_back(order::Open{std::move(path)});
        state.browser_open = false;
    };
    const char* title = labels  ? "Labels of this volume"
                        : fused ? "A volume over the slices of this one"
                                : "Open a volume, a scene or a project";
    ImGui::Begin(title, &state.browser_open,
                 ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                     ImGuiWindowFlags_NoSavedSettings);
    if (ImGui::Button("up"))
        browse(fs::path(browsed_).parent_path());
    note("browser/up");
    ImGui::SameLine();
    if (const char* home = std::getenv("HOME"); home && ImGui::Button("home"))
        browse(home);
    ImGui::SameLine();
    if (ImGui::Button("open this folder")) // of DICOM files or slices, or a project
        open(browsed_);
    note("browser/folder");
    ImGui::SetNextItemWidth(-1.0f);
    if (ImGui::InputText("##path", typed_.data(), typed_.size(),
                         ImGuiInputTextFlags_EnterReturnsTrue)) {
        std::error_code ignored;
        if (fs::is_directory(typed_.data(), ignored))
            browse(typed_.data());
        else
            open(typed_.data());
    }
    note("browser/path");
    if (!browser_error_.empty())
        ImGui::TextColored(ImVec4(1.0f, 0.6f, 0.3f, 1.0f), "%s", browser_error_.c_str());
    if (ImGui::BeginChild("entries", ImVec2(0.0f, 0.0f), true)) {
        fs::path next;
        ImGuiListClipper rows;
        rows.Begin(static_cast<int>(entries_.size()));
        while (rows.Step())
            for (int i = rows.DisplayStart; i < rows.DisplayEnd; ++i) {
                const BrowserEntry& entry = entries_[static_cast<size_t>(i)];
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
                    const fs::path path = fs::path(browsed_) / entry.name;
                    if (entry.is_folder && !Project::is_one(path))
                        next = path;
                    else
                        open(path.string());
                }
                note(fmt::format("browser/{}", entry.name).c_str());
                if (!bytes.empty()) {
                    ImGui::SameLine(bytes_at);
                    ImGui::TextDisabled("%s", bytes.c_str());
                }
                ImGui::PopID();
            }
        if (!next.empty())
            browse(next);
    }
    ImGui::EndChild();
    ImGui::End();
}

void Interface::browse(const fs::path& folder) {
    Result<std::vector<BrowserEntry>> list = list_folder(folder);
    browser_error_ = list ? "" : list.error().message;
    if (!list && !browsed_.empty())
        return; // stay where it can be read
    browsed_ = folder.string();
    entries_ = list ? std::move(*list) : std::vector<BrowserEntry>{};
    typed_ = {};
    browsed_.copy(typed_.data(), typed_.size() - 1);
}

// While a file is read.
void Interface::draw_opening(const ViewState& state, std::vector<Order>& orders) {
    if (state.opening.empty())
        return;
    ImGui::SetNextWindowPos(ImVec2(0.5f * static_cast<float>(state.size_px.x),
                                   0.5f * static_cast<float>(state.size_px.y)),
                            ImGuiCond_Always, ImVec2(0.5f, 0.5f));
    ImGui::Begin("Opening", nullptr,
                 ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings);
    if (!state.names_hidden)
        ImGui::TextUnformatted(state.opening.c_str());
    const double seconds = std::max(0.0, time_s_ - state.opening_since_s);
    const std::string shown = state.opening_share > 0.0
                                  ? fmt::format("{:.0f} %", 100.0 * state.opening_share)
                                  : fmt::format("{:.0f} s", seconds);
    ImGui::ProgressBar(static_cast<float>(state.opening_share),
                       ImVec2(18.0f * ImGui::GetFontSize(), 0.0f), shown.c_str());
    note("opening/share");
    if (ImGui::Button("cancel"))
        orders.push_back(order::CancelOpening{});
    note("opening/cancel");
    ImGui::End();
}

} // namespace palpate::view
