#include "apps/view/drawing/looks.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstring>
#include <span>

#include "apps/view/drawing/letters.h"

namespace palpate::view {

namespace {

// A line of letters of 13 pixels is 18 high: Noto Sans rises 1.069 and falls 0.293 of its size, and
// ImGui's size of a font is the sum.
constexpr double kLine_px = 18.0;

// Letters of names of labels, files and units: Latin, Greek, Cyrillic, signs.
constexpr ImWchar kRanges[] = {0x20,   0x17F,  0x18F,  0x192,  0x1A0,  0x1B0,  0x1E0,  0x233,
                               0x2BC,  0x2C7,  0x370,  0x3FF,  0x400,  0x52F,  0x1E00, 0x1EFF,
                               0x2010, 0x2044, 0x2070, 0x208E, 0x20A0, 0x20BF, 0x2100, 0x2122,
                               0x2190, 0x2199, 0x2212, 0x2215, 0x2248, 0x2265, 0};

// Bold letters: names and words of the window.
constexpr ImWchar kBoldRanges[] = {0x20,   0x17F,  0x370,  0x3FF,  0x400, 0x45F,
                                   0x2010, 0x2044, 0x2212, 0x2212, 0};
constexpr double kIcon_px = 20.0;
constexpr double kTitle_px = 16.5; // of a line of letters of 12 pixels
constexpr ImWchar kTitleRanges[] = {0x20, 0x7E, 0};
// Names of fonts of the atlas.
constexpr const char *kBold = "bold", *kIcon = "icons", *kTitle = "titles";

ImFont* font_of(const char* name) {
    for (ImFont* font : ImGui::GetIO().Fonts->Fonts)
        if (std::strcmp(font->ConfigData->Name, name) == 0)
            return font;
    return nullptr;
}

void add_font(std::span<const unsigned char> file, const char* name, double size_px,
              const ImWchar* ranges) {
    ImFontConfig config;
    config.PixelSnapH = true; // letters lie on whole pixels
    config.OversampleH = config.OversampleV = 1;
    config.FontDataOwnedByAtlas = false;
    std::strncpy(config.Name, name, sizeof(config.Name) - 1);
    // ImGui reads what it is given, and takes it as not constant.
    ImGui::GetIO().Fonts->AddFontFromMemoryTTF(
        const_cast<unsigned char*>(file.data()), static_cast<int>(file.size()),
        static_cast<float>(std::round(size_px)), &config, ranges);
}

// Pairs of ends, and 0 as the last, of one icon each.
const ImWchar* ranges_of_icons() {
    static const auto ranges = [] {
        std::array<ImWchar, 2 * std::size(kIcons) + 1> all{};
        for (size_t i = 0; i < std::size(kIcons); ++i)
            all[2 * i] = all[2 * i + 1] = static_cast<ImWchar>(kIcons[i]);
        return all;
    }();
    return ranges.data();
}

double linear(uint32_t part) {
    const double value = part / 255.0;
    return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

double luminance(uint32_t rgb) {
    return 0.2126 * linear((rgb >> 16) & 0xFF) + 0.7152 * linear((rgb >> 8) & 0xFF) +
           0.0722 * linear(rgb & 0xFF);
}

} // namespace

double contrast(uint32_t first, uint32_t second) {
    const double one = luminance(first), other = luminance(second);
    return (std::max(one, other) + 0.05) / (std::min(one, other) + 0.05);
}

void load_letters(double text_scale) {
    ImFontAtlas& fonts = *ImGui::GetIO().Fonts;
    if (letters_file().empty()) {
        ImFontConfig config;
        config.PixelSnapH = true;
        config.OversampleH = config.OversampleV = 1;
        config.SizePixels = std::round(13.0f * static_cast<float>(text_scale));
        fonts.AddFontDefault(&config);
    } else {
        add_font(letters_file(), "letters", kLine_px * text_scale, kRanges);
    }
    if (!bold_file().empty()) {
        add_font(bold_file(), kBold, kLine_px * text_scale, kBoldRanges);
        add_font(bold_file(), kTitle, kTitle_px * text_scale, kTitleRanges);
    }
    if (!icons_file().empty())
        add_font(icons_file(), kIcon, kIcon_px * text_scale, ranges_of_icons());
    fonts.Build();
}

ImFont* bold_letters() {
    ImFont* const bold = font_of(kBold);
    return bold ? bold : ImGui::GetIO().Fonts->Fonts[0];
}

void draw_spaced(ImDrawList& list, ImVec2 left_middle, const char* title, ImU32 color) {
    ImFont* const titles = font_of(kTitle);
    ImFont* const font = titles ? titles : ImGui::GetIO().Fonts->Fonts[0];
    const float spacing = std::round(font->FontSize / 16.0f);
    ImVec2 at(left_middle.x, std::round(left_middle.y - 0.5f * font->FontSize));
    for (const char* letter = title; *letter; ++letter) {
        const auto code = static_cast<ImWchar>(std::toupper(static_cast<unsigned char>(*letter)));
        font->RenderChar(&list, font->FontSize, at, color, code);
        at.x += font->GetCharAdvance(code) + spacing;
    }
}

bool draw_icon(ImDrawList& list, ImVec2 middle, float size_px, Icon icon, ImU32 color) {
    ImFont* const font = font_of(kIcon);
    const auto code = static_cast<ImWchar>(icon);
    const ImFontGlyph* const glyph = font ? font->FindGlyphNoFallback(code) : nullptr;
    if (!glyph)
        return false;
    const float scale = size_px / font->FontSize;
    const auto from = [&](float at, float low, float high) { // on whole pixels: sharp
        return std::round(at - 0.5f * scale * (low + high));
    };
    font->RenderChar(&list, size_px,
                     {from(middle.x, glyph->X0, glyph->X1), from(middle.y, glyph->Y0, glyph->Y1)},
                     color, code);
    return true;
}

void set_lengths(double text_scale) {
    ImGuiStyle& style = ImGui::GetStyle();
    style.WindowRounding = 0.0f;
    style.WindowBorderSize = 0.0f;
    style.FrameBorderSize = style.PopupBorderSize = 1.0f; // a field is hardly seen without a rim
    style.PopupRounding = style.FrameRounding = style.GrabRounding = 6.0f;
    style.ScrollbarRounding = 6.0f;
    style.FramePadding = {6.0f, 3.0f};
    style.GrabMinSize = 13.0f; // the handle of a slider
    style.ItemSpacing = {8.0f, 4.0f};
    style.ScrollbarSize = 12.0f;
    style.ScaleAllSizes(static_cast<float>(text_scale));
}

void use_theme(bool light) {
    const Theme& theme = theme_of(light);
    light ? ImGui::StyleColorsLight() : ImGui::StyleColorsDark();
    ImGuiStyle& style = ImGui::GetStyle();
    const auto set = [&](ImGuiCol which, uint32_t rgb, float opacity = 1.0f) {
        style.Colors[which] = rgb_color(rgb, opacity);
    };
    set(ImGuiCol_Text, theme.text);
    set(ImGuiCol_TextDisabled, theme.hint);
    set(ImGuiCol_WindowBg, theme.panel);
    set(ImGuiCol_PopupBg, theme.panel);
    set(ImGuiCol_MenuBarBg, theme.panel);
    set(ImGuiCol_Border, theme.rim);
    set(ImGuiCol_BorderShadow, 0, 0.0f);
    set(ImGuiCol_Separator, theme.line);
    set(ImGuiCol_FrameBg, theme.field);
    set(ImGuiCol_FrameBgHovered, theme.line);
    set(ImGuiCol_FrameBgActive, theme.line);
    set(ImGuiCol_TitleBg, theme.ground);
    set(ImGuiCol_TitleBgActive, theme.ground);
    set(ImGuiCol_ScrollbarBg, theme.panel, 0.0f);
    set(ImGuiCol_ScrollbarGrab, theme.line);
    set(ImGuiCol_ScrollbarGrabHovered, theme.hint);
    set(ImGuiCol_ScrollbarGrabActive, theme.hint);
    set(ImGuiCol_CheckMark, theme.accent_text);
    set(ImGuiCol_SliderGrab, theme.handle);
    set(ImGuiCol_SliderGrabActive, theme.accent);
    set(ImGuiCol_Button, theme.field);
    set(ImGuiCol_ButtonHovered, theme.accent, 0.35f);
    set(ImGuiCol_ButtonActive, theme.accent, 0.5f);
    set(ImGuiCol_Header, theme.accent, light ? theme.chosen : 0.25f);
    set(ImGuiCol_HeaderHovered, theme.line);
    set(ImGuiCol_HeaderActive, theme.line);
    set(ImGuiCol_TableHeaderBg, theme.field);
    set(ImGuiCol_TableBorderLight, theme.line);
    set(ImGuiCol_TableBorderStrong, theme.line);
    set(ImGuiCol_PlotLines, theme.accent_text);
    set(ImGuiCol_PlotHistogram, theme.accent);
    set(ImGuiCol_TextSelectedBg, theme.accent, 0.35f);
}

} // namespace palpate::view
