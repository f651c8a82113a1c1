#pragma once

#include <span>
#include <string_view>

#include "engine/segment/task.h"

namespace palpate::view {

// The input of a change of a label, beside the label map.
struct LabelChangeInput {
    uint16_t label = 1;                 // that changes
    double by_mm = 1.0;                 // by how far
    std::span<const uint16_t> locked{}; // labels that stay; the caller sees to it as well
    glm::uvec3 at{};                    // the sample at the crosshair, in the map
};

// A change of one label as a whole, which a button orders. Other labels keep their samples, and
// what the label gains was 0, unless it changes others.
struct LabelChange {
    const char* id;        // of its button: "labels/<id>"
    const char* title;     // of the button, and of the step
    const char* told;      // behind the label's new volume: "in its largest piece"
    const char* unchanged; // behind "label 1 .. ", where no sample changes
    bool takes_mm;         // by how far
    bool changes_others;   // other labels, too
    Result<Volume> (*change)(const Volume& labels, const LabelChangeInput& in, const Task& task);
    bool is_daily = false; // its button is always there; those of others are folded away
};
std::span<const LabelChange> label_changes();
const LabelChange& label_change(std::string_view id); // one that there is

} // namespace palpate::view
