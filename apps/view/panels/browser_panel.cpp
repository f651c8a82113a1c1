// The browser of files.

#include <imgui/imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <filesystem>

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

std::string date_text(int64_t modified_s) {
    std::tm day{};
    const auto time = static_cast<std::time_t>(modified_s);
    std::array<char, 32> text{};
    if (modified_s == 0 || !::localtime_r(&time, &day) ||
        std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M", &day) == 0)
        return "";
    return text.data();
}

void browse(Browser& panel, const fs::path& folder) {
    Result<std::vector<BrowserEntry>> list = list_folder(folder);
    panel.error = list ? "" : list.error().message;
    if (!list && !panel.folder.empty())
        return; // stay where it can be read
    panel.folder = folder.string();
    panel.entries = list ? std::move(*list) : std::vector<BrowserEntry>{};
    sort_entries(panel.entries, panel.order, panel.falls);
}

fs::path home() {
    const char* home = std::getenv("HOME");
    return home ? home : "";
}

std::vector<fs::path> mounts() {
    const char* user = std::getenv("USER");
    std::vector<fs::path> all{"/media", "/mnt", "/run/media"};
    if (user) {
        all.push_back(fs::path("/media") / user);
        all.push_back(fs::path("/run/media") / user);
    }
    return all;
}

// The path in the field: whole, from the home folder, or a name in the folder.
fs::path typed_path(const Browser& panel) {
    const std::string text = panel.typed.data();
    if (text.starts_with("synthetic:"))
        return text;
    if (text == "~" || text.starts_with("~/"))
        return home() / text.substr(std::min<size_t>(2, text.size()));
    const bool here = fs::path(panel.folder) == fs::current_path();
    return here ? fs::path(text) : fs::path(panel.folder) / text; // short where it can be
}

// The part of a name that is sought; a path is not sought among names.
std::string sought(const Browser& panel) {
    const std::string text = panel.typed.data();
    return text.find('/') == std::string::npos ? text : "";
}

// The second press of a double click that has entered a folder takes nothing out of the new list.
void follow_presses(Browser& panel, double time_s) {
    constexpr double kDoubleClick_s = 0.5, kNear_px = 6.0;
    if (!ImGui::IsMouseClicked(ImGuiMouseButton_Left))
        return;
    const ImVec2 at = ImGui::GetMousePos();
    panel.entered_again =
        time_s - panel.entered_s < kDoubleClick_s &&
        std::hypot(at.x - panel.pressed_px.x, at.y - panel.pressed_px.y) < kNear_px;
    panel.pressed_px = {at.x, at.y};
}

struct Choice { // of a frame
    fs::path folder{}, file{};
    std::string pointed{}; // the file under the pointer
};

// The whole name of a row's file, and its picture once it is there.
void draw_file_tip(Widgets& ui, const std::string& name, const std::string& path,
                   const FilePreview& preview) {
    ImGui::BeginTooltip();
    ImGui::TextUnformatted(name.c_str());
    using State = SeriesPreviews::State;
    if (preview.picture && preview.path == path) {
        const State is = preview.picture->state(0);
        constexpr auto kSide = static_cast<float>(SeriesPreviews::kSide_px);
        const glm::vec2 share = kSide / glm::vec2(preview.picture->size_px());
        if (is == State::there) {
            ImGui::Image(
                reinterpret_cast<ImTextureID>(static_cast<uintptr_t>(Interface::kFileTexture)),
                {2.0f * kSide, 2.0f * kSide}, {0.0f, 0.0f}, {share.x, share.y});
            ui.note("browser/preview");
        } else {
            ImGui::TextDisabled("%s", is == State::waiting ? "reading .." : "no picture");
        }
    }
    ImGui::EndTooltip();
}

// Where a person goes on: the folder of the file that was opened last, once; else as before.
fs::path first_folder(Browser& panel, const std::vector<std::string>& recent) {
    const std::string last = recent.empty() ? "" : recent.front();
    std::error_code ignored;
    const fs::path folder = fs::path(last).parent_path();
    if (std::exchange(panel.opened_last, last) != last && fs::is_directory(folder, ignored))
        return folder;
    return panel.folder.empty() ? fs::current_path() : fs::path(panel.folder);
}

void draw_recent(Widgets& ui, const std::vector<std::string>& recent, Choice& choice) {
    if (recent.empty())
        return;
    ImGui::Spacing();
    ImGui::TextDisabled("opened last");
    constexpr size_t kMost = 8;
    for (size_t i = 0; i < std::min(recent.size(), kMost); ++i) {
        ImGui::PushID(static_cast<int>(i));
        const std::string name = fs::path(recent[i]).filename().string();
        if (ImGui::Selectable(fitted(name, ImGui::GetContentRegionAvail().x).c_str()))
            choice.file = recent[i];
        if (ImGui::IsItemHovered())
            ImGui::SetTooltip("%s", recent[i].c_str());
        ui.note(fmt::format("browser/recent/{}", i));
        ImGui::PopID();
    }
}

void draw_places(Widgets& ui, const Browser& panel, Choice& choice) {
    for (size_t i = 0; i < panel.places.size(); ++i) {
        const BrowserPlace& place = panel.places[i];
        ImGui::PushID(static_cast<int>(i));
        if (ImGui::Selectable(fitted(place.name, ImGui::GetContentRegionAvail().x).c_str(),
                              place.folder == fs::path(panel.folder)))
            choice.folder = place.folder;
        if (ImGui::IsItemHovered())
            ImGui::SetTooltip("%s", place.folder.c_str());
        ui.note(fmt::format("browser/place/{}", i));
        ImGui::PopID();
    }
}

void draw_heads(Widgets& ui, Browser& panel) {
    constexpr std::pair<const char*, EntryOrder> heads[] = {
        {"name", EntryOrder::name}, {"size", EntryOrder::size}, {"changed", EntryOrder::date}};
    for (const auto& [name, order] : heads) {
        ImGui::TableNextColumn();
        const bool is_it = panel.order == order;
        const std::string text = fmt::format("{}{}", name,
                                             !is_it        ? ""
                                             : panel.falls ? ", falling"
                                                           : ", rising");
        if (ImGui::Selectable(text.c_str())) {
            // A second click turns the order; the newest and the largest are sought first.
            panel.falls = is_it ? !panel.falls : order != EntryOrder::name;
            panel.order = order;
            sort_entries(panel.entries, panel.order, panel.falls);
        }
        ui.note(fmt::format("browser/by/{}", name));
    }
}

void draw_entries(Widgets& ui, Browser& panel, bool names, const FilePreview& preview,
                  Choice& choice) {
    const std::vector<size_t> listed =
        listed_entries(panel.entries, names ? "" : sought(panel), panel.all_files || names);
    if (!ImGui::BeginTable("entries", 3,
                           ImGuiTableFlags_ScrollY | ImGuiTableFlags_RowBg |
                               ImGuiTableFlags_SizingFixedFit | ImGuiTableFlags_PadOuterX))
        return;
    ImGui::TableSetupScrollFreeze(0, 1);
    ImGui::TableSetupColumn("name", ImGuiTableColumnFlags_WidthStretch);
    ImGui::TableSetupColumn("size");
    ImGui::TableSetupColumn("changed");
    ImGui::TableNextRow();
    draw_heads(ui, panel);
    ImGuiListClipper rows;
    rows.Begin(static_cast<int>(listed.size()));
    while (rows.Step())
        for (int i = rows.DisplayStart; i < rows.DisplayEnd; ++i) {
            const BrowserEntry& entry = panel.entries[listed[static_cast<size_t>(i)]];
            const std::string name = entry.is_folder ? entry.name + "/" : entry.name;
            ImGui::PushID(i);
            ImGui::TableNextRow();
            ImGui::TableNextColumn();
            const std::string shown = fitted(name, ImGui::GetContentRegionAvail().x);
            const bool chosen =
                ImGui::Selectable(shown.c_str(), false, ImGuiSelectableFlags_SpanAllColumns);
            if (ImGui::IsItemHovered() && (shown != name || (!entry.is_folder && !names))) {
                const std::string path = (fs::path(panel.folder) / entry.name).string();
                choice.pointed = entry.is_folder || names ? "" : path;
                draw_file_tip(ui, name, path, preview);
            }
            ui.note(fmt::format("browser/{}", entry.name));
            if (chosen && !panel.entered_again) {
                const fs::path path = fs::path(panel.folder) / entry.name;
                (entry.is_folder && !Project::is_one(path) ? choice.folder : choice.file) = path;
            }
            ImGui::TableNextColumn();
            ImGui::TextDisabled("%s", entry.is_folder ? "" : size_text(entry.bytes).c_str());
            ImGui::TableNextColumn();
            ImGui::TextDisabled("%s", date_text(entry.modified_s).c_str());
            ImGui::PopID();
        }
    if (listed.empty()) {
        ImGui::TableNextRow();
        ImGui::TableNextColumn();
        hint(panel.entries.empty() ? "this folder is empty"
             : sought(panel).empty() || names
                 ? "no folder, and no file that can be opened: \"all files\" lists the others"
                 : "no name here has these letters");
        ui.note("browser/none");
    }
    ImGui::EndTable();
}

// Enter: a folder is gone into; the only one that is listed is taken, of a name that is not whole.
void enter(const Browser& panel, bool names, Choice& choice) {
    std::error_code ignored;
    const fs::path path = typed_path(panel);
    if (fs::is_directory(path, ignored) && !Project::is_one(path)) {
        choice.folder = path;
        return;
    }
    choice.file = path;
    const std::string part = sought(panel);
    if (names || fs::exists(path, ignored) || part.empty())
        return;
    const std::vector<size_t> listed = listed_entries(panel.entries, part, panel.all_files);
    if (listed.size() != 1)
        return;
    const BrowserEntry& only = panel.entries[listed.front()];
    (only.is_folder ? choice.folder : choice.file) = fs::path(panel.folder) / only.name;
    if (only.is_folder)
        choice.file.clear();
}

const char* title_of(Browsing browsing) {
    switch (browsing) {
        case Browsing::labels:
            return "Labels of this volume";
        case Browsing::fused:
            return "A volume over the slices of this one";
        case Browsing::name:
            return "Where to write";
        case Browsing::documents:
            break;
    }
    return "Open a volume, a scene or a project";
}

} // namespace

void draw_browser(Widgets& ui, Browser& panel, const std::vector<std::string>& recent,
                  const FilePreview& preview, ViewState& state) {
    const bool begins = !std::exchange(panel.was_open, state.browser_open);
    state.pointed_file.clear();
    if (!state.browser_open)
        return;
    const bool names = state.browsing == Browsing::name;
    if (begins) { // as it is now
        const fs::path named = names ? fs::absolute(ui.named.second) : fs::path();
        browse(panel, names ? named.parent_path() : first_folder(panel, recent));
        panel.places = browser_places(
            home(), state.names_hidden ? std::vector<std::string>{} : recent, mounts());
        type(panel.typed, names ? named.filename().string() : "");
    }
    const ImVec2 size(std::min(0.8f * static_cast<float>(state.size_px.x),
                               760.0f * static_cast<float>(state.text_scale)),
                      0.75f * static_cast<float>(state.size_px.y));
    ImGui::SetNextWindowSize(size);
    begin_dialog(title_of(state.browsing), &state.browser_open, state, ImGuiWindowFlags_NoResize);
    follow_presses(panel, ui.time_s);
    Choice choice;
    if (ImGui::Button("up"))
        choice.folder = fs::path(panel.folder).parent_path();
    ui.note("browser/up");
    ImGui::SameLine();
    const bool here = ImGui::Button(names ? "write here" : "open this folder");
    ui.note("browser/folder"); // of DICOM files or slices, or a project
    ImGui::SameLine();
    ui.check("all files", "browser/all", panel.all_files);
    ImGui::TextDisabled("%s", fitted(panel.folder, ImGui::GetContentRegionAvail().x).c_str());
    if (begins)
        ImGui::SetKeyboardFocusHere();
    ImGui::SetNextItemWidth(-1.0f);
    if (ImGui::InputTextWithHint("##path", "a part of a name, or a path", panel.typed.data(),
                                 panel.typed.size(), ImGuiInputTextFlags_EnterReturnsTrue))
        enter(panel, names, choice);
    ui.note("browser/path");
    if (here)
        choice.file = names ? typed_path(panel) : fs::path(panel.folder);
    if (!panel.error.empty())
        ImGui::TextColored(rgb_color(theme_of(state.light).danger), "%s", panel.error.c_str());
    if (const size_t pictures = count_pictures(panel.entries); !names && pictures > 1) {
        hint(fmt::format("{} pictures lie here: \"open this folder\" reads them as the slices of a "
                         "volume",
                         pictures)
                 .c_str());
        ui.note("browser/pictures");
    }
    const float room = ImGui::GetContentRegionAvail().x;
    if (ImGui::BeginChild("places", ImVec2(0.22f * room, 0.0f)))
        draw_places(ui, panel, choice);
    if (!names && !state.names_hidden) {
        ImGui::PushID("recent");
        draw_recent(ui, recent, choice);
        ImGui::PopID();
    }
    ImGui::EndChild();
    ImGui::SameLine();
    if (ImGui::BeginChild("list"))
        draw_entries(ui, panel, names, preview, choice);
    ImGui::EndChild();
    ImGui::End();
    if (ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape))) {
        state.browser_open = false;
        return;
    }
    if (choice.pointed != panel.pointed)
        panel.pointed_s = ui.time_s;
    panel.pointed = choice.pointed;
    constexpr double kPointed_s = 0.4; // a pointer that passes asks for nothing
    if (ui.time_s - panel.pointed_s >= kPointed_s)
        state.pointed_file = panel.pointed;
    if (!choice.folder.empty()) {
        browse(panel, choice.folder);
        panel.entered_s = ui.time_s;
        if (!names)
            type(panel.typed, "");
        return;
    }
    if (choice.file.empty() || (names && here && panel.typed[0] == '\0')) // it has no name
        return;
    std::string path = choice.file.string();
    state.browser_open = false;
    switch (state.browsing) {
        case Browsing::documents:
            return ui.order(order::Open{std::move(path)});
        case Browsing::labels:
            return ui.order(order::OpenLabels{std::move(path)});
        case Browsing::fused:
            return ui.order(order::OpenFused{std::move(path)});
        case Browsing::name:
            ui.named = {state.naming, std::move(path)};
    }
}

} // namespace palpate::view
