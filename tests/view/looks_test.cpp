// Letters and colours of the interface.

#include <gtest/gtest.h>

#include <cmath>

#include "apps/view/drawing/letters.h"
#include "apps/view/drawing/looks.h"
#include "apps/view/panels/widgets.h"

namespace palpate::view {
namespace {

// By the definition of WCAG 2.1: 21 between black and white, and #767676 on white is known as the
// lightest grey that passes 4.5.
TEST(Looks, ContrastIsThatOfTheGuidelines) {
    EXPECT_DOUBLE_EQ(contrast(0x000000, 0xFFFFFF), 21.0);
    EXPECT_DOUBLE_EQ(contrast(0x123456, 0x123456), 1.0);
    EXPECT_GE(contrast(0x767676, 0xFFFFFF), 4.5);
    EXPECT_LT(contrast(0x777777, 0xFFFFFF), 4.5);
    EXPECT_EQ(contrast(0x2F6FED, 0x1D2126), contrast(0x1D2126, 0x2F6FED));
}

TEST(Looks, LettersHaveAContrastOfFourAndAHalf) {
    for (const bool light : {false, true}) {
        const Theme& theme = theme_of(light);
        for (const uint32_t letters : {theme.text, theme.second, theme.hint, theme.accent_text,
                                       theme.good, theme.warning, theme.danger})
            EXPECT_GE(contrast(letters, theme.panel), 4.5) << light << " " << std::hex << letters;
        for (const uint32_t letters : {theme.text, theme.second})
            for (const uint32_t ground : {theme.field, theme.line, theme.ground})
                EXPECT_GE(contrast(letters, ground), 4.5) << light << " " << std::hex << letters;
        EXPECT_GE(contrast(theme.on_accent, theme.accent), 4.5) << light;
        // Handles are no letters: 3 is asked of them (WCAG 2.1, 1.4.11).
        EXPECT_GE(contrast(theme.handle, theme.field), 3.0) << light;
    }
}

// One colour over another, as the interface is drawn: a mean of bytes.
uint32_t over(uint32_t top, float opacity, uint32_t under) {
    uint32_t mixed = 0;
    for (const int shift : {16, 8, 0}) {
        const auto part = [&](uint32_t rgb) { return static_cast<float>((rgb >> shift) & 0xFF); };
        const float mean = opacity * part(top) + (1.0f - opacity) * part(under);
        mixed |= static_cast<uint32_t>(std::lround(mean)) << shift;
    }
    return mixed;
}

// Letters on what is chosen, under the pointer, or pressed.
TEST(Looks, LettersOnWhatIsChosenHaveAContrastOfFourAndAHalf) {
    for (const bool light : {false, true}) {
        const Theme& theme = theme_of(light);
        const uint32_t chosen = over(theme.accent, theme.chosen, theme.panel);
        for (const uint32_t letters : {theme.text, theme.second, theme.accent_text})
            EXPECT_GE(contrast(letters, chosen), 4.5) << light << " " << std::hex << letters;
        ImGui::CreateContext();
        use_theme(light);
        for (const ImGuiCol which : {ImGuiCol_ButtonHovered, ImGuiCol_ButtonActive, ImGuiCol_Header,
                                     ImGuiCol_HeaderHovered, ImGuiCol_HeaderActive}) {
            const ImVec4 color = ImGui::GetStyle().Colors[which];
            const auto byte = [](float part) {
                return static_cast<uint32_t>(std::lround(255.0f * part));
            };
            const uint32_t rgb = byte(color.x) << 16 | byte(color.y) << 8 | byte(color.z);
            EXPECT_GE(contrast(theme.text, over(rgb, color.w, theme.panel)), 4.5)
                << light << " " << ImGui::GetStyleColorName(which);
        }
        ImGui::DestroyContext();
    }
}

// Digits are as wide as each other, so that numbers that change stand still; a line is 18 pixels.
TEST(Looks, DigitsAreEquallyWide) {
    for (const double scale : {1.0, 1.5, 2.0}) {
        ImGui::CreateContext();
        load_letters(scale);
        ImFont* font = ImGui::GetIO().Fonts->Fonts[0];
        const float width = font->GetCharAdvance('0');
        for (ImWchar digit = '1'; digit <= '9'; ++digit)
            EXPECT_EQ(font->GetCharAdvance(digit), width) << scale;
        EXPECT_EQ(width, std::round(width)) << scale; // on whole pixels
        if (!letters_file().empty()) {
            EXPECT_EQ(font->FontSize, 18.0f * static_cast<float>(scale));
            for (const ImWchar sign :
                 {ImWchar(0xB3), ImWchar(0xB1), ImWchar(0x3B1), ImWchar(0x416)})
                EXPECT_NE(font->FindGlyphNoFallback(sign), nullptr)
                    << sign; // 3 above, +-, alpha, Zhe
        }
        EXPECT_EQ(bold_letters()->FontSize, font->FontSize);
        ImDrawList list(ImGui::GetDrawListSharedData());
        list._ResetForNewFrame();
        for (const Icon icon : kIcons) {
            const bool is_drawn = draw_icon(list, {50, 50}, 20.0f, icon, IM_COL32_WHITE);
            EXPECT_EQ(is_drawn, !icons_file().empty()) << static_cast<int>(icon);
        }
        EXPECT_FALSE(draw_icon(list, {50, 50}, 20.0f, Icon::none, IM_COL32_WHITE));
        ImGui::DestroyContext();
    }
}

// Lines of a name have room, hold all of its letters but blanks at their ends, and end within a
// word only where the word alone is too wide.
TEST(Looks, NamesAreBrokenIntoLinesAndKeptWhole) {
    ImGui::CreateContext();
    load_letters(1.0);
    ImGui::GetIO().DisplaySize = {640.0f, 480.0f};
    ImGui::GetIO().IniFilename = nullptr;
    ImGui::NewFrame();
    const auto joined = [](const std::vector<std::string>& lines) {
        std::string all;
        for (const std::string& line : lines)
            for (const char letter : line)
                all += letter == ' ' ? "" : std::string(1, letter);
        return all;
    };
    for (const auto& [name, whole] :
         {std::pair("portal_vein_and_splenic_vein", "portal_vein_and_splenic_vein"),
          {"left kidney, lower pole", "leftkidney,lowerpole"},
          {"Ligamentum teres uteri", "Ligamentumteresuteri"},
          {"sternocleidomastoideus", "sternocleidomastoideus"},
          {"\u043f\u0435\u0447\u0435\u043d\u044c", "\u043f\u0435\u0447\u0435\u043d\u044c"},
          {"x", "x"},
          {"", ""}})
        for (const float first : {40.0f, 90.0f, 400.0f}) {
            const float width = 1.5f * first;
            const std::vector<std::string> lines = name_lines(name, first, width);
            ASSERT_GE(lines.size(), 1u);
            EXPECT_EQ(joined(lines), whole) << first;
            for (size_t i = 0; i < lines.size(); ++i)
                EXPECT_LE(ImGui::CalcTextSize(lines[i].c_str()).x, i == 0 ? first : width);
        }
    for (const auto& [name, lines] :
         {std::pair("kidney_left", std::vector<std::string>{"kidney_", "left"}),
          {"left kidney", {"left", "kidney"}}}) {
        const float just_too_narrow = ImGui::CalcTextSize(name).x - 1.0f;
        EXPECT_EQ(name_lines(name, just_too_narrow, just_too_narrow), lines);
    }
    ImGui::EndFrame();
    ImGui::DestroyContext();
}

} // namespace
} // namespace palpate::view
