#include "engine/session/kept.h"

#include <algorithm>

namespace palpate {

namespace {
constexpr size_t kMostMeasures = 100000, kMostLabels = 65536;
} // namespace

Json kept_json(const Kept& kept) {
    Json json = Json::object();
    for (const Measure& measure : kept.measures)
        json["measures"].push_back(measure_json(measure));
    for (const LabelName& name : kept.label_names) {
        Json entry{{"label", name.label}, {"name", name.name}};
        if (name.color)
            entry["color"] = *name.color;
        json["label_names"].push_back(std::move(entry));
    }
    if (!kept.locked_labels.empty())
        json["locked_labels"] = kept.locked_labels;
    if (kept.crosshair_mm)
        json["crosshair_mm"] = *kept.crosshair_mm;
    if (kept.tool_radius_mm)
        json["tool_radius_mm"] = *kept.tool_radius_mm;
    if (kept.tool_label)
        json["tool_label"] = *kept.tool_label;
    return json;
}

Kept read_kept(const JsonValue& in) {
    Kept kept;
    if (const auto measures = in.find("measures"))
        for (const JsonValue& measure : measures->items(0, kMostMeasures))
            kept.measures.push_back(read_measure(measure));
    if (const auto names = in.find("label_names"))
        for (const JsonValue& entry : names->items(0, kMostLabels)) {
            entry.only_keys({"label", "name", "color"});
            LabelName& name = kept.label_names.emplace_back();
            name.label = entry.at("label").whole_number(0, 65535);
            entry.take("name", name.name);
            if (const auto color = entry.find("color"))
                name.color = color->vector(0.0, 1.0);
        }
    if (const auto locked = in.find("locked_labels"))
        for (const JsonValue& label : locked->items(0, kMostLabels))
            kept.locked_labels.push_back(static_cast<uint16_t>(label.whole_number(1, 65535)));
    if (const auto crosshair = in.find("crosshair_mm"))
        kept.crosshair_mm = crosshair->vector(-1e9, 1e9);
    if (const auto radius = in.find("tool_radius_mm"))
        kept.tool_radius_mm = radius->number_above(0.0, 1e6);
    if (const auto label = in.find("tool_label"))
        kept.tool_label = static_cast<uint16_t>(label->whole_number(1, 65535));
    std::sort(kept.locked_labels.begin(), kept.locked_labels.end());
    return kept;
}

} // namespace palpate
