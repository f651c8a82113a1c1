#pragma once

#include <imgui/imgui.h>

#include <cstdint>

#include "apps/view/drawing/icons.h"

namespace palpate::view {

// The looks of the interface: its letters and its colours.

// The colours of one theme, 0xRRGGBB. Each colour of letters has a contrast of 4.5 or more (WCAG 2)
// on all grounds that it is used on.
struct Theme {
    uint32_t ground, panel;         // behind views; of panels
    uint32_t field, line;           // of fields and buttons; where the pointer is on them
    uint32_t rim;                   // of fields and buttons
    uint32_t text, second, hint;    // on panels; text and second on fields, too
    uint32_t accent, on_accent;     // a filled button and its letters
    uint32_t accent_text;           // on panels
    uint32_t good, warning, danger; // on panels
    uint32_t handle;                // of sliders, on fields
    float chosen; // opacity of the accent on a panel behind text, second and accent_text
};
constexpr Theme kDarkTheme{.ground = 0x15181C,
                           .panel = 0x1D2126,
                           .field = 0x262B31,
                           .line = 0x323942,
                           .rim = 0x4F5964,
                           .text = 0xDFE3E8,
                           .second = 0xAEB6BF,
                           .hint = 0x8B949E,
                           .accent = 0x2F6FED,
                           .on_accent = 0xFFFFFF,
                           .accent_text = 0x8FB4FF,
                           .good = 0x7EE2A8,
                           .warning = 0xFFD479,
                           .danger = 0xFF8F7A,
                           .handle = 0x8FB4FF,
                           .chosen = 0.2f};
constexpr Theme kLightTheme{.ground = 0xF4F5F7,
                            .panel = 0xFFFFFF,
                            .field = 0xEDEFF2,
                            .line = 0xD9DEE4,
                            .rim = 0x9AA4AE,
                            .text = 0x1B1F24,
                            .second = 0x57606A,
                            .hint = 0x656D76,
                            .accent = 0x1F5FDB,
                            .on_accent = 0xFFFFFF,
                            .accent_text = 0x1F5FDB,
                            .good = 0x1A7F37,
                            .warning = 0x8A5A00,
                            .danger = 0xC0301C,
                            .handle = 0x1F5FDB,
                            .chosen = 0.12f};
constexpr const Theme& theme_of(bool light) {
    return light ? kLightTheme : kDarkTheme;
}

// The contrast of two colours, 1 .. 21: WCAG 2.1, "contrast ratio".
double contrast(uint32_t first, uint32_t second);

inline ImVec4 rgb_color(uint32_t rgb, float opacity = 1.0f) {
    const auto part = [&](int shift) { return static_cast<float>((rgb >> shift) & 0xFF) / 255.0f; };
    return {part(16), part(8), part(0), opacity};
}

// Letters of the interface in the current context of ImGui, at the size of 13 pixels times
// `text_scale`: Noto Sans as the build has found it, else ImGui's own. And bold ones, and icons.
void load_letters(double text_scale);
ImFont* bold_letters(); // those of the text where the build has found no bold ones

// Draws a title in small bold capitals, spaced, its middle at the height of the point. In ASCII.
void draw_spaced(ImDrawList& list, ImVec2 left_middle, const char* title, ImU32 color);

// Draws an icon of this size about a point. False: there is no such icon, or the build has found
// no font of icons, and nothing is drawn.
bool draw_icon(ImDrawList& list, ImVec2 middle, float size_px, Icon icon, ImU32 color);

// Lengths of the style, once.
void set_lengths(double text_scale);
// Colours of the style; both themes have the same lengths.
void use_theme(bool light);

} // namespace palpate::view
