#pragma once

#include <span>
#include <string>
#include <vector>

#include "engine/image/image.h"
#include "engine/scene/scene.h"

namespace palpate {

// Dark or bright ink, with a rim of the other; by_picture: for each mark the one that stands out
// from what lies below it. In a movie that would change from picture to picture.
enum class FigureInk { by_picture, bright, dark };

// One row of a legend.
struct LegendEntry {
    std::string name;
    glm::dvec3 color{1.0};
};

// Marks over a picture for print: what a reader must know to read it.
struct Figure {
    bool letters = false;   // at the edges: to which side of the patient they lie (letters_of())
    bool scale_bar = false; // lower right; for perspective in the focal plane, which it says
    bool color_bar = false; // upper right: colours of color_function() with their values
    std::vector<std::string> note{}; // lines in the upper left corner
    // Lower left, in columns from above; where all have no room, in smaller letters, and what has
    // none even so is counted: "and 12 more".
    std::vector<LegendEntry> legend{};
    std::string unit{}; // of values: "HU"; empty: none is written
    FigureInk ink = FigureInk::by_picture;
    bool transparent = false; // the background is, and a bright page is to show through
    double line_px = 0.0;     // height of a line of text; 0: 1/26 of the picture's
};

// Draws the marks into the pictures of the scene's camera, one or two eyes of one size: in stereo
// they lie at the depth of the screen. Draw them before eyes are laid out for a display, so that a
// mirrored picture mirrors them as well. Pictures have channels R, G, B, and colours associated
// with A where they have that (strokes.h). A line of the note that has no room ends in "..".
void annotate(std::span<Image> eyes, const Scene& scene, const Figure& figure);

// The function that a colour bar shows: that of slices where there are any, else that of rays in
// modes mip and alpha. Null where there is none, or where it has one value alone.
const TransferFunction* color_function(const Scene& scene);

// The lines of a corner note: the volume's name, the place of the scene's slices, and its window or
// iso-values.
std::vector<std::string> note_of(const Scene& scene, const Grid& grid, const std::string& name,
                                 const std::string& unit);

} // namespace palpate
