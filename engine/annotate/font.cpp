#include "engine/annotate/font.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/gtc/constants.hpp>
#include <sstream>
#include <string>

namespace palpate {

namespace {

// Strokes of ' ' to '~'. "M x y" lifts the pen and moves it, "L x y" draws a line, "A cx cy rx ry
// from to" an arc of an ellipse (degrees, counter-clockwise where `to` is larger) with a line to
// its begin where the pen is down, "a" the same with the pen lifted before.
constexpr std::array<const char*, 95> kGlyphs{
    "",
    "M 0 14 L 0 4.5 M 0 0 L 0 0.1",
    "M 0 14 L 0 10.5 M 3 14 L 3 10.5",
    "M 2 0 L 4 14 M 6 0 L 8 14 M 0 4.5 L 9.3 4.5 M 0.7 9.5 L 10 9.5",
    "A 4.5 10.4 4 3.6 35 270 A 4.5 3.4 4.4 3.4 90 -145 M 4.5 16 L 4.5 -2",
    "A 2.5 11 2.5 3 0 360 M 10 14 L 2 0 a 9.5 3 2.5 3 0 360",
    "M 9.5 0 L 2.2 9.4 A 4.3 11.3 2.6 2.7 220 -35 L 2 6.6 A 3.9 3.5 3.9 3.5 120 300 L 9 6",
    "M 0 14 L 0 10.5",
    "A 6 5.5 6 10.5 125 235",
    "A -3 5.5 6 10.5 55 -55",
    "M 3 14 L 3 8 M 0.4 12.5 L 5.6 9.5 M 5.6 12.5 L 0.4 9.5",
    "M 0 6 L 8 6 M 4 2 L 4 10",
    "M 0.8 0.3 L 0 -2.5",
    "M 0 5.6 L 5 5.6",
    "M 0 0 L 0 0.1",
    "M 0 -2 L 6 14.5",
    "A 4.5 7 4.5 7 0 360",
    "M 1 11 L 4.5 14 L 4.5 0",
    "A 4.5 9.6 4.4 4.4 160 -40 L 0.3 0 L 9 0",
    "A 4.3 10.3 3.8 3.7 150 -90 A 4.3 3.3 4.3 3.3 90 -150",
    "M 6.5 0 L 6.5 14 L 0 4 L 9 4",
    "M 8 14 L 1.3 14 L 0.8 7.6 A 4.2 4.6 4.4 4.6 140 -150",
    "A 7.5 4.5 7.5 9.5 95 180 A 4.5 4.5 4.5 4.5 180 -180",
    "M 0 14 L 9 14 L 3 0",
    "A 4.5 10.5 3.8 3.5 -90 270 A 4.5 3.5 4.5 3.5 90 450",
    "A 4.5 9.5 4.5 4.5 360 0 A 1.5 9.5 7.5 9.5 0 -85",
    "M 0 0 L 0 0.1 M 0 8 L 0 8.1",
    "M 0.8 0.3 L 0 -2.5 M 0.8 8 L 0.8 8.1",
    "M 8 10.5 L 0 6 L 8 1.5",
    "M 0 4 L 8 4 M 0 8 L 8 8",
    "M 0 10.5 L 8 6 L 0 1.5",
    "A 3.7 10.3 3.7 3.7 160 -50 L 3.6 4.4 M 3.6 0 L 3.6 0.1",
    "A 6 5 2.8 3 0 360 M 8.8 8 L 8.8 4.2 A 10.4 4.2 1.6 2 180 350 a 6 5.5 6 7 -10 300",
    "M 0 0 L 5 14 L 10 0 M 1.8 5 L 8.2 5",
    "M 0 0 L 0 14 L 4.5 14 A 4.5 10.6 3.6 3.4 90 -90 L 0 7.2 M 4.5 7.2 A 4.8 3.6 4.2 3.6 90 -90 "
    "L 0 0",
    "A 5.5 7 5.5 7 50 310",
    "M 0 0 L 0 14 L 3.5 14 A 3.5 7 6 7 90 -90 L 0 0",
    "M 8 14 L 0 14 L 0 0 L 8 0 M 0 7.3 L 7 7.3",
    "M 8 14 L 0 14 L 0 0 M 0 7.3 L 7 7.3",
    "A 5.5 7 5.5 7 50 320 L 9.7 6.3 L 6 6.3",
    "M 0 0 L 0 14 M 9 0 L 9 14 M 0 7.3 L 9 7.3",
    "M 0 0 L 5 0 M 2.5 0 L 2.5 14 M 0 14 L 5 14",
    "M 6 14 L 6 4 A 3 4 3 4 0 -170",
    "M 0 0 L 0 14 M 8.5 14 L 0 5 M 3 8.2 L 9 0",
    "M 0 14 L 0 0 L 7.5 0",
    "M 0 0 L 0 14 L 5.5 4 L 11 14 L 11 0",
    "M 0 0 L 0 14 L 9 0 L 9 14",
    "A 5.8 7 5.8 7 0 360",
    "M 0 0 L 0 14 L 4.8 14 A 4.8 10.3 3.8 3.7 90 -90 L 0 6.6",
    "A 5.8 7 5.8 7 0 360 M 7 4 L 11 -1",
    "M 0 0 L 0 14 L 4.8 14 A 4.8 10.3 3.8 3.7 90 -90 L 0 6.6 M 4.5 6.6 L 9 0",
    "A 4.5 10.4 4 3.6 35 270 A 4.5 3.4 4.4 3.4 90 -145",
    "M 0 14 L 10 14 M 5 14 L 5 0",
    "M 0 14 L 0 4.5 A 4.5 4.5 4.5 4.5 180 360 L 9 14",
    "M 0 14 L 5 0 L 10 14",
    "M 0 14 L 3.5 0 L 7 12 L 10.5 0 L 14 14",
    "M 0 0 L 9 14 M 0 14 L 9 0",
    "M 0 14 L 4.8 6.8 L 9.6 14 M 4.8 6.8 L 4.8 0",
    "M 0 14 L 9 14 L 0 0 L 9 0",
    "M 3.5 15 L 0 15 L 0 -3 L 3.5 -3",
    "M 0 14.5 L 6 -2",
    "M 0 15 L 3.5 15 L 3.5 -3 L 0 -3",
    "M 0 9 L 3.5 14 L 7 9",
    "M 0 -2.5 L 9 -2.5",
    "M 0 14 L 2 11.5",
    "A 4 5 4 5 0 360 M 8 10 L 8 0",
    "M 0 14 L 0 0 M 0 5 A 4 5 4 5 180 -180",
    "A 4.2 5 4.2 5 50 310",
    "M 8 14 L 8 0 M 8 5 A 4 5 4 5 0 360",
    "M 0.1 5.4 L 8 5.4 A 4 5 4 5 5 310",
    "A 4.6 11.3 2.6 2.7 70 180 L 2 0 M 0 9.6 L 5 9.6",
    "A 4 5 4 5 0 360 M 8 10 L 8 -0.5 A 4.2 -0.5 3.8 3.7 0 -150",
    "M 0 14 L 0 0 M 0 5.8 A 3.8 5.8 3.8 4.2 180 0 L 7.6 0",
    "M 0 10 L 0 0 M 0 13.6 L 0 13.7",
    "M 2.5 10 L 2.5 -1.5 A 0 -1.5 2.5 2.6 0 -75 M 2.5 13.6 L 2.5 13.7",
    "M 0 14 L 0 0 M 6.5 10 L 0 3.8 M 2.4 6.1 L 7 0",
    "M 0 14 L 0 2.5 A 2.5 2.5 2.5 2.5 180 280",
    "M 0 10 L 0 0 M 0 6.4 A 3 6.4 3 3.6 180 0 L 6 0 M 6 6.4 A 9 6.4 3 3.6 180 0 L 12 0",
    "M 0 10 L 0 0 M 0 5.8 A 3.8 5.8 3.8 4.2 180 0 L 7.6 0",
    "A 4.2 5 4.2 5 0 360",
    "M 0 10 L 0 -4 M 0 5 A 4 5 4 5 180 -180",
    "M 8 10 L 8 -4 M 8 5 A 4 5 4 5 0 360",
    "M 0 10 L 0 0 M 0 5.8 A 3.6 5.8 3.6 4.2 180 65",
    "A 3.4 7.5 3 2.5 35 270 A 3.4 2.5 3.3 2.5 90 -150",
    "M 2 13.5 L 2 2.8 A 4.6 2.8 2.6 2.8 180 290 M 0 9.8 L 5 9.8",
    "M 0 10 L 0 4.2 A 3.8 4.2 3.8 4.2 180 360 M 7.6 10 L 7.6 0",
    "M 0 10 L 3.8 0 L 7.6 10",
    "M 0 10 L 2.8 0 L 5.5 8.5 L 8.2 0 L 11 10",
    "M 0 0 L 7 10 M 0 10 L 7 0",
    "M 0 10 L 3.9 0 M 7.6 10 L 2.2 -4",
    "M 0 10 L 7 10 L 0 0 L 7 0",
    "M 4 15 A 4 12.5 2 2.5 90 180 L 2 8.5 L 0.3 6 L 2 3.5 L 2 -0.5 A 4 -0.5 2 2.5 180 270",
    "M 0 15 L 0 -3.5",
    "M 0 15 A 0 12.5 2 2.5 90 0 L 2 8.5 L 3.7 6 L 2 3.5 L 2 -0.5 A 0 -0.5 2 2.5 0 -90",
    "M 0 5 L 2 7 L 6 5 L 8 7",
};
constexpr double kGap = 4.2, kSpace = 4.5; // between letters; of a space beside the gap

struct Glyph {
    std::vector<Segment> strokes; // from x = 0 on
    double width = 0.0;
};

Glyph make_glyph(const char* text) {
    Glyph glyph;
    glm::dvec2 pen(0.0);
    bool down = false;
    const auto draw_to = [&](glm::dvec2 to) {
        if (down)
            glyph.strokes.push_back({pen, to});
        pen = to;
        down = true;
    };
    std::istringstream in(text);
    for (std::string command; in >> command;) {
        if (command == "M" || command == "L") {
            glm::dvec2 to;
            in >> to.x >> to.y;
            down = down && command == "L";
            draw_to(to);
            continue;
        }
        glm::dvec2 center, radius, turn;
        in >> center.x >> center.y >> radius.x >> radius.y >> turn.x >> turn.y;
        down = down && command == "A";
        const int parts = 1 + static_cast<int>(std::abs(turn.y - turn.x) / 12.0);
        for (int i = 0; i <= parts; ++i) {
            const double angle = glm::radians(glm::mix(turn.x, turn.y, double(i) / parts));
            draw_to(center + radius * glm::dvec2(std::cos(angle), std::sin(angle)));
        }
    }
    double first = 1e9, last = -1e9;
    for (const Segment& s : glyph.strokes) {
        first = std::min({first, s.from.x, s.to.x});
        last = std::max({last, s.from.x, s.to.x});
    }
    for (Segment& s : glyph.strokes)
        for (glm::dvec2* end : {&s.from, &s.to})
            end->x -= first;
    glyph.width = glyph.strokes.empty() ? kSpace : last - first;
    return glyph;
}

const Glyph& glyph_of(char32_t letter) {
    static const std::vector<Glyph> glyphs = [] {
        std::vector<Glyph> all;
        for (const char* text : kGlyphs)
            all.push_back(make_glyph(text));
        return all;
    }();
    return glyphs[letter >= ' ' && letter <= '~' ? letter - ' ' : '?' - ' '];
}

// Calls visit(glyph, x) for each character; returns the width.
template <class Visit>
double lay_out(std::string_view text, const Visit& visit) {
    double x = 0.0;
    for (size_t i = 0; i < text.size(); ++i) {
        const auto byte = static_cast<uint8_t>(text[i]);
        if ((byte & 0xc0) == 0x80)
            continue; // of a character that began before
        const Glyph& glyph = glyph_of(byte);
        visit(glyph, x);
        x += glyph.width + kGap;
    }
    return std::max(0.0, x - kGap);
}

} // namespace

std::vector<Segment> text_strokes(std::string_view text) {
    std::vector<Segment> all;
    lay_out(text, [&](const Glyph& glyph, double x) {
        for (const Segment& s : glyph.strokes)
            all.push_back({s.from + glm::dvec2(x, 0.0), s.to + glm::dvec2(x, 0.0)});
    });
    return all;
}

double text_width(std::string_view text) {
    return lay_out(text, [](const Glyph&, double) {});
}

} // namespace palpate
