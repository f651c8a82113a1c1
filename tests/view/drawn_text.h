#pragma once

#include <imgui/imgui.h>

#include <algorithm>
#include <vector>

namespace palpate::view {

// A letter, or an icon, as the interface draws it: pixels of the window.
struct DrawnLetter {
    ImVec2 low, high;
    ImVec4 clip;  // it is cut off outside: left, top, right, bottom
    bool is_part; // a part of a glyph: the rest is cut off at the left or the right

    ImVec2 middle() const { return {0.5f * (low.x + high.x), 0.5f * (low.y + high.y)}; }
};

// All letters of a frame, read from its triangles: quads with a texture that varies across them, as
// nothing else has.
inline std::vector<DrawnLetter> letters_of(const ImDrawData& data) {
    std::vector<DrawnLetter> all;
    const auto is_part = [](ImVec2 from, ImVec2 to) {
        for (const ImFont* font : ImGui::GetIO().Fonts->Fonts)
            for (const ImFontGlyph& glyph : font->Glyphs)
                if (from.x >= glyph.U0 && to.x <= glyph.U1 && from.y >= glyph.V0 &&
                    to.y <= glyph.V1)
                    return from.x != glyph.U0 || to.x != glyph.U1;
        return false; // no letter
    };
    for (int i = 0; i < data.CmdListsCount; ++i) {
        const ImDrawList& list = *data.CmdLists[i];
        for (const ImDrawCmd& command : list.CmdBuffer) {
            if (command.UserCallback || command.TextureId != ImGui::GetIO().Fonts->TexID)
                continue;
            for (unsigned k = 0; k + 6 <= command.ElemCount; k += 3) {
                const auto at = [&](unsigned n) -> const ImDrawVert& {
                    return list.VtxBuffer[static_cast<int>(
                        command.VtxOffset +
                        list.IdxBuffer[static_cast<int>(command.IdxOffset + k + n)])];
                };
                // ImDrawList::PrimRectUV: corners 0 1 2, 0 2 3 of a rectangle.
                const ImDrawVert &a = at(0), &b = at(1), &c = at(2), &d = at(5);
                const bool is_quad = a.pos.y == b.pos.y && b.pos.x == c.pos.x &&
                                     c.pos.y == d.pos.y && d.pos.x == a.pos.x;
                if (!is_quad || a.uv.x == c.uv.x || a.uv.y == c.uv.y || a.uv.y != b.uv.y)
                    continue;
                all.push_back({a.pos, c.pos, command.ClipRect, is_part(a.uv, c.uv)});
                k += 3; // its second triangle
            }
        }
    }
    return all;
}

} // namespace palpate::view
