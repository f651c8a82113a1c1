#pragma once

#include <span>
#include <string_view>

#include "engine/segment/task.h"

namespace palpate::view {

// A change of one label as a whole, which a button orders. Other labels keep their samples: what
// the label gains was 0.
struct LabelChange {
    const char* id;        // of its button: "labels/<id>"
    const char* title;     // of the button, and of the step
    const char* told;      // behind the label's new volume: "in its largest piece"
    const char* unchanged; // behind "label 1 .. ", where no sample changes
    bool takes_mm;         // by how far
    Result<Volume> (*change)(const Volume& labels, uint16_t label, double by_mm, const Task& task);
};
std::span<const LabelChange> label_changes();
const LabelChange& label_change(std::string_view id); // one that there is

} // namespace palpate::view
