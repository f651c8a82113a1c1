#pragma once

#include <span>

#include "engine/annotate/font.h"
#include "engine/image/image.h"

// Marks drawn into the channels R, G, B, and A where there is one, of a picture. Places are in
// pixels, (0, 0) the upper left corner of the upper left pixel. Colours are associated with alpha,
// as a renderer leaves them: a mark of coverage c makes C' = c ink + (1 - c) C and A' = c +
// (1 - c) A. What lies outside the picture is left out.
namespace palpate {

// Lines of a round pen, `width_px` thick; coverage by the distance from the nearest line, so that
// edges are smooth.
void draw_strokes(Image& image, std::span<const Segment> strokes, double width_px, glm::dvec3 ink);

// A filled box; pixels at its edges are covered by their share of it.
void fill_box(Image& image, glm::dvec2 low, glm::dvec2 high, glm::dvec3 ink);

// How text is drawn: in ink, on a rim of another colour that parts it from what is below it.
struct Pen {
    double line_px; // from a line to the next; a capital is kCapital / kLine of it high
    glm::dvec3 ink, rim;

    double thickness_px() const { return 0.085 * line_px; }
    double rim_px() const { return 0.09 * line_px; }
};
// Strokes with their rim.
void draw_strokes(Image& image, std::span<const Segment> strokes, const Pen& pen);
// Text whose box, as wide as the text and as high as a capital, lies at `at` less `anchor` (0 .. 1)
// of its size.
void draw_text(Image& image, glm::dvec2 at, glm::dvec2 anchor, std::string_view text,
               const Pen& pen);
double text_width_px(std::string_view text, const Pen& pen);

// Divides colours by alpha, as a PNG stores them (Porter & Duff 1984 call the associated ones
// premultiplied); 0 where alpha is 0. A picture without channel A stays as it is.
Image with_straight_alpha(Image image);

} // namespace palpate
