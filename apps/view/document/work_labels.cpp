// The part of a document's work that knows labels: their map, names and colours.

#include <algorithm>

#include "apps/view/document/work.h"

namespace palpate::view {

// Gives labels to a project that has none.
bool Work::put_labels() {
    return edited().document.find(labels_) ||
           session_.put({labels_, VolumeKind::labels, empty_labels(subject_.grid)},
                        "new label map");
}

bool Work::has_labels() {
    const EditState state = edited();
    const Volume* labels = state.document.find(labels_);
    return labels && labels->range().max > 0.0f;
}

void Work::take_labels(LoadedVolume labels) {
    Notes notes = noted_.known();
    notes.label_names.clear(); // those of other labels, as are the colours
    notes.label_styles.clear();
    for (const LabelName& name : labels.labels) {
        if (name.label == 0 || name.label > 65535)
            continue;
        name_label(notes, name.label, name.name);
        if (name.color)
            set_style(notes, name.label, {*name.color, true});
    }
    if (!session_.put({labels_, VolumeKind::labels, std::move(labels.volume)}, "labels of a file",
                      Json::object(), noted_.changes_to(notes)))
        return;
    noted_.expect_change();
    message_ = "labels read from the file";
    for (const auto* said : {&labels.warnings, &labels.notes})
        for (const std::string& text : *said)
            tell_also(text);
}

std::string Work::name_of_label(uint32_t label) const {
    return numbered_name(noted_.known(), label);
}

} // namespace palpate::view
