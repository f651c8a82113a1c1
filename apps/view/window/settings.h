#pragma once

#include <filesystem>

#include "apps/view/window/panel.h"
#include "apps/view/window/sections.h"
#include "engine/base/error.h"

namespace palpate::view {

// How a person likes windows to look, kept from one start of the program to the next.
struct Settings {
    bool light = false;
    double text_scale = 0.0; // 0: as the display asks; else 0.5 .. 4
    double panel_px = kPanel_px;
    OpenSections sections{};
    bool indices = false;    // of samples, beside places in mm
    bool hints_seen = false; // those of the first start

    friend bool operator==(const Settings&, const Settings&) = default;
};

// A file of the program's state: $XDG_STATE_HOME/palpate/NAME (XDG Base Directory Specification),
// by default in ~/.local/state; empty where the environment names no home.
std::filesystem::path state_file(const char* name);

// {"light": true, "text_scale": 1.5, "panel_px": 264, "indices": false, "sections": {"clips":
// true}} in "view.json". The defaults where the file is not there or is damaged.
Settings load_settings(const std::filesystem::path& file);
// Nothing where the file's name is empty. An error where it cannot be written.
Result<void> save_settings(const std::filesystem::path& file, const Settings& settings);

} // namespace palpate::view
