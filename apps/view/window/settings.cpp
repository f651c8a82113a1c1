#include "apps/view/window/settings.h"

#include <cstdlib>
#include <span>

#include "engine/base/file.h"
#include "engine/base/json.h"

namespace palpate::view {

namespace fs = std::filesystem;

fs::path state_file(const char* name) {
    const char* state = std::getenv("XDG_STATE_HOME");
    const char* home = std::getenv("HOME");
    if (state && *state == '/')
        return fs::path(state) / "palpate" / name;
    return home && *home == '/' ? fs::path(home) / ".local/state/palpate" / name : fs::path();
}

Settings load_settings(const fs::path& file) {
    Settings settings;
    if (file.empty())
        return settings;
    const Result<std::string> text = load_text(file, 1 << 20);
    const Result<Json> json = text ? parse_json(*text, file.string()) : Result<Json>(fail("none"));
    if (!json || json->kind != Json::Kind::object)
        return settings;
    if (const Json* light = json->find("light"))
        settings.light = light->boolean;
    if (const Json* indices = json->find("indices"))
        settings.indices = indices->boolean;
    if (const Json* seen = json->find("hints_seen"))
        settings.hints_seen = seen->boolean;
    if (const Json* scale = json->find("text_scale"))
        if (scale->number >= 0.5 && scale->number <= 4.0)
            settings.text_scale = scale->number;
    if (const Json* width = json->find("panel_px"))
        if (width->number >= kNarrowestPanel_px && width->number <= kWidestPanel_px)
            settings.panel_px = width->number;
    if (const Json* open = json->find("sections"))
        for (const SectionEntry& one : sections())
            if (const Json* is_open = open->find(one.name))
                settings.sections.set(one.section, is_open->boolean);
    return settings;
}

Result<void> save_settings(const fs::path& file, const Settings& settings) {
    if (file.empty())
        return {};
    std::error_code error;
    fs::create_directories(file.parent_path(), error);
    Json json{{"light", settings.light},
              {"text_scale", settings.text_scale},
              {"panel_px", settings.panel_px},
              {"indices", settings.indices},
              {"hints_seen", settings.hints_seen}};
    for (const SectionEntry& one : sections())
        json["sections"][one.name] = settings.sections.has(one.section);
    const std::string text = json_text(json);
    return save_bytes(file, std::as_bytes(std::span(text)));
}

} // namespace palpate::view
