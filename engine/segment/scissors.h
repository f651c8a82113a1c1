#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/segment/task.h"

namespace palpate {

enum class ScissorsAction {
    erase_inside,  // samples within the outline become 0
    erase_outside, // those without
    fill_inside,   // samples of 0 within the outline become the label
};

// A closed outline that is drawn over labels as they are seen: in a slice along its normal, in 3D
// from the camera. It cuts through all depths, or through some.
//
// A sample lies within the outline if the place at which its centre is seen does, even-odd. From an
// eye, a sample in its plane or behind it is seen nowhere, and lies without.
struct Scissors {
    ScissorsAction action = ScissorsAction::erase_inside;
    // The corners, in the patient; at least 3. They are places that are seen: how far away they lie
    // has no effect but on depths_mm. From an eye, all lie in front of it.
    std::vector<glm::dvec3> outline_mm{};
    glm::dvec3 towards{0.0, 0.0, 1.0};  // that is looked along; not 0
    std::optional<glm::dvec3> eye_mm{}; // from where; none: rays are parallel
    uint16_t label = 1;                 // that loses or gains samples
    // Every label loses samples; a fill takes those of others, too.
    bool all_labels = false;
    // Samples alone whose centres lie so far along `towards` from the plane across it through the
    // first corner, both ends included; none: all depths.
    std::optional<std::pair<double, double>> depths_mm{};
    // Samples alone that are seen first: on the line from the centre to the eye, through the boxes
    // of samples about their centres, all are 0 after those that may be erased have ended. Not of a
    // fill.
    bool seen_first = false;

    friend bool operator==(const Scissors&, const Scissors&) = default;
};

// The map after a cut. Samples of `locked` labels stay, and hide others. The map's own type, u16
// where that does not hold the label; bricks that do not change stay shared. Refused: what is said
// above, values that are no labels, a label of 0 or one that is locked, unless all are erased.
// Memory: a brick for each thread, and two bits a sample for seen_first.
Result<Volume> cut_labels(const Volume& labels, const Scissors& scissors,
                          std::span<const uint16_t> locked, const Task& task);

// Scissors of a JSON text:
//     {"scissors": 1, "units": "mm", "action": "erase-inside", "label": 1, "all_labels": false,
//      "outline_mm": [[x, y, z], ..], "towards": [x, y, z], "eye_mm": [x, y, z],
//      "depths_mm": [low, high], "seen_first": false}
// Places are LPS mm. action: or "erase-outside", "fill-inside". Without eye_mm rays are parallel,
// without depths_mm it goes through all. `name` is the file's, for messages.
Result<Scissors> parse_scissors(std::string_view text, const std::string& name);

} // namespace palpate
