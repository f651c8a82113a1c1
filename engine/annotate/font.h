#pragma once

#include <glm/glm.hpp>
#include <string_view>
#include <vector>

namespace palpate {

// A straight piece of a stroke.
struct Segment {
    glm::dvec2 from, to;
};

// A font of strokes: each letter is a few lines and arcs, drawn with a round pen of any width, so
// that it is sharp at any size and needs no file. Printable ASCII; other characters are "?". UTF-8.
//
// Units: a capital is 14 high and the baseline is y = 0; y points up. Ascenders reach 15,
// descenders -4.
constexpr double kCapital = 14.0;
constexpr double kLine = 22.0; // from a baseline to the next

// The strokes of a line of text that begins at (0, 0).
std::vector<Segment> text_strokes(std::string_view text);
double text_width(std::string_view text); // without space behind the last letter

} // namespace palpate
