// The part of a document's work that knows labels: their map, names and colours.

#include <algorithm>

#include "apps/view/document/work.h"

namespace palpate::view {

LabelStyle& own_style(LabelLayer& layer, uint32_t label) {
    while (layer.styles.size() <= label)
        layer.styles.push_back(style_of(layer, static_cast<uint32_t>(layer.styles.size())));
    return layer.styles[label];
}

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
    const Beside before = beside();
    const std::string title = "labels of a file";
    if (!session_.put({labels_, VolumeKind::labels, std::move(labels.volume)}, title))
        return;
    keep_beside(before, title);
    message_ = "labels read from the file";
    for (const auto* said : {&labels.warnings, &labels.notes})
        for (const std::string& text : *said)
            tell_also(text);
    Scene scene = session_.scene();
    if (!scene.labels)
        scene.labels = LabelLayer{};
    loaded_.label_names.clear(); // those of other labels, as are the colours
    scene.labels->styles.clear();
    for (const LabelName& name : labels.labels) {
        if (name.label == 0 || name.label > 65535)
            continue;
        name_label(name.label, name.name);
        if (name.color)
            own_style(*scene.labels, name.label).color = *name.color;
    }
    session_.show(std::move(scene));
}

std::string Work::name_of_label(uint32_t label) const {
    for (const LabelName& name : loaded_.label_names)
        if (name.label == label && !name.name.empty())
            return fmt::format("{} {}", label, name.name);
    return std::to_string(label);
}

std::string Work::own_name_of_label(uint32_t label) const {
    for (const LabelName& name : loaded_.label_names)
        if (name.label == label)
            return name.name;
    return {};
}

void Work::name_label(uint32_t label, const std::string& name) {
    auto& names = loaded_.label_names;
    const auto known = std::ranges::find(names, label, &LabelName::label);
    if (known == names.end())
        names.push_back({label, name, {}});
    else if (name.empty() && !known->color)
        names.erase(known);
    else
        known->name = name;
}

} // namespace palpate::view
