#include "apps/view/script/dump.h"

#include "engine/measure/measure_report.h"
#include "engine/scene/presets.h"

namespace palpate::view {

void dump_panels(Work& work, const ViewState& state, Json& json) {
    json["tab"] = name_of(state.tab);
    work.watch(state);
    MeasureReport report;
    for (const Measure& measure : state.notes.measures)
        if (const auto measured = work.measured(measure))
            report.measures.push_back({measure, *measured});
    json["measures"] = report_json(report)["measures"];
    json["measuring"] = {
        {"kind", name_of(state.measuring.kind)},
        {"begun", state.measuring.begun.size()},
        {"selected", state.measuring.selected ? Json(*state.measuring.selected) : Json()}};
    const auto known = work.figures().known();
    json["label_counts"] = Json::object();
    for (size_t label = 1; label < known->label_counts.size(); ++label)
        if (known->label_counts[label] > 0)
            json["label_counts"][std::to_string(label)] = known->label_counts[label];
    json["label_names"] = Json::object();
    for (const LabelName& name : state.notes.label_names)
        json["label_names"][std::to_string(name.label)] = name.name;
    json["locked_labels"] = Json::array();
    for (const uint16_t label : state.notes.locked_labels)
        json["locked_labels"].push_back(label);
    json["clips"] = Json::array();
    for (const ClipPlane& plane : state.notes.clip_planes)
        json["clips"].push_back({{"point_mm", plane.point_mm},
                                 {"normal", plane.normal},
                                 {"offset_mm", glm::dot(plane.normal, plane.point_mm)}});
    const FigureSetup& figure = state.figure;
    json["figure"] = {
        {"panel", name_of(figure.panel)}, {"size", {figure.size_px.x, figure.size_px.y}},
        {"letters", figure.letters},      {"scale_bar", figure.scale_bar},
        {"color_bar", figure.color_bar},  {"note", figure.note},
        {"pictures", figure.pictures}};
    for (const auto& [name, paper] : kPapers)
        if (paper == figure.paper)
            json["figure"]["paper"] = name;
    json["browser_open"] = state.browser_open;
    json["series_open"] = state.series_open;
    json["saving_open"] = state.saving_open;
    json["leaving"] = !state.leaving ? "" : state.leaving->closes ? "close" : state.leaving->path;
    json["names_hidden"] = state.names_hidden;
    json["light"] = state.light;
    json["text_scale"] = state.text_scale;
    json["steps"] = Json::array();
    for (const std::string& title : work.session().step_titles())
        json["steps"].push_back(title);
    const Scene& scene = work.session().scene();
    if (scene.labels)
        for (const uint32_t label : {1u, 2u, 3u})
            json["label_styles"][std::to_string(label)] = {
                {"color", style_of(*scene.labels, label).color},
                {"visible", style_of(*scene.labels, label).visible}};
    if (!scene.ray_cast)
        return;
    json["transfer"] = transfer_function_json(scene.ray_cast->transfer);
    json["isos"] = Json::array();
    for (const IsoSurface& iso : scene.ray_cast->isos)
        json["isos"].push_back(iso.value);
    const haptics::TouchParameters& touch = work.session().parameters();
    json["touch"] = {{"iso", touch.iso}, {"opacity_points", touch.opacity.point_count}};
}

} // namespace palpate::view
