#include "apps/view/script/dump.h"

#include "apps/view/tools/tool.h"
#include "apps/view/tools/wire_tool.h"
#include "engine/measure/measure_report.h"
#include "engine/scene/presets.h"
#include "engine/scene/scene_names.h"
#include "engine/volume/content_hash.h"

namespace palpate::view {

namespace {

Json json_of(glm::dvec3 v) {
    return {v.x, v.y, v.z};
}

Json box_json(const Box& box) {
    return {box.low_px.x, box.low_px.y, box.size_px.x, box.size_px.y};
}

const char* slab_name(SlabMode mode) {
    for (const auto& [name, one] : Names<SlabMode>::list)
        if (one == mode)
            return name;
    return "";
}

Json stereo_json(const ViewState& state) {
    const StereoView& stereo = state.stereo;
    Json json{{"on", stereo.on},
              {"swap_eyes", stereo.swap_eyes},
              {"mirror", stereo.mirror},
              {"separation", stereo.separation},
              {"profile", stereo.profile ? stereo.profile->name : ""}};
    for (const auto& [name, layout] : Names<StereoLayout>::list)
        if (layout == stereo.layout)
            json["layout"] = name;
    if (state.cursor_mm)
        json["cursor_mm"] = json_of(*state.cursor_mm);
    return json;
}

void dump_mask(const ViewState& state, Json& json) {
    constexpr const char* areas[] = {"everywhere", "inside one label", "outside one label",
                                     "inside all labels", "outside all labels"};
    constexpr const char* over[] = {"all labels", "no label", "one label"};
    json["mask"] = {{"area", areas[static_cast<size_t>(state.masking.area)]},
                    {"area_label", state.masking.area_label},
                    {"overwrite", over[static_cast<size_t>(state.masking.overwrite)]},
                    {"over_label", state.masking.over_label}};
}

Json hand_json(Work& work, const ViewState& state) {
    const Touch& touch = work.hand().touch();
    const Stylus& stylus = state.stylus;
    const std::optional<TouchSample>& now = touch.now();
    Json json{{"on", stylus.on},
              {"device", stylus.on ? touch.options().device : ""},
              {"algorithm", touch.options().algorithm},
              {"armed", touch.armed()},
              {"first", name_of(stylus.first)},
              {"second", name_of(stylus.second)},
              {"shape", name_of(stylus.shape)},
              {"push_mm", stylus.push_mm},
              {"sound_on", stylus.sound_on},
              {"dust_shown", stylus.dust_shown},
              {"removed_mm3", work.session().milling().removed_mm3},
              {"grains", work.hand().dust().made()},
              {"sound_level", milling_level(work.session().milling())}};
    if (stylus.by_pointer)
        json["meant_mm"] = json_of(stylus.meant.position_mm);
    if (now) {
        json["probe_mm"] = json_of(now->probe.position_mm);
        json["proxy_mm"] = json_of(now->proxy.position_mm);
        json["force_n"] = json_of(now->force_n);
        json["energy_mj"] = now->energy_mj;
        json["plate"] = now->plate.plate;
    }
    return json;
}

Json segmenting_json(Work& work, const ViewState& state) {
    constexpr const char* brushes[] = {"inside", "outside", "erase"};
    Json json{{"brush", brushes[static_cast<size_t>(state.segmenting.brush)]},
              {"method", state.segmenting.method},
              {"runs", work.segmentation().share().has_value()},
              {"wire_samples", state.own.of<Wiring>().frozen.size()}};
    for (const auto& [method, values] : state.segmenting.given)
        for (const auto& [name, value] : values)
            json["given"][method][name] = value;
    if (const auto& strength = work.segmentation().strength())
        json["bound"] = strength->bound;
    return json;
}

// The part that the panels show.
void dump_panels(Work& work, const ViewState& state, Json& json) {
    json["task"] = name_of(state.task);
    json["sections_open"] = Json::array(); // of the task
    for (const SectionEntry& one : sections())
        if (is_shown(state, one.section))
            json["sections_open"].push_back(one.name);
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
    json["removed_ml"] = Json::object(); // "all", and by label where there was any
    if (const auto removed = work.removed().now()) {
        json["removed_ml"]["all"] = 1e-3 * removed->all_mm3;
        for (const auto& [label, mm3] : removed->by_label_mm3)
            json["removed_ml"][std::to_string(label)] = 1e-3 * mm3;
    }
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
    json["figure"] = {{"panel", name_of(figure.panel)},
                      {"size", {figure.size_px.x, figure.size_px.y}},
                      {"letters", figure.letters},
                      {"legend", figure.legend},
                      {"scale_bar", figure.scale_bar},
                      {"color_bar", figure.color_bar},
                      {"note", figure.note},
                      {"pictures", figure.pictures}};
    for (const auto& [name, paper] : kPapers)
        if (paper == figure.paper)
            json["figure"]["paper"] = name;
    json["browser_open"] = state.browser_open;
    json["welcome_open"] = state.welcome_open;
    json["hints_open"] = state.hints.open;
    json["series_open"] = state.series_open;
    json["saving_open"] = state.saving_open;
    json["leaving"] = !state.leaving ? "" : state.leaving->closes ? "close" : state.leaving->path;
    json["file_question"] = !state.file_question ? ""
                            : state.file_question->about == FileQuestion::About::label_map
                                ? "labels"
                                : "series";
    json["names_hidden"] = state.names_hidden;
    json["light"] = state.light;
    json["indices_shown"] = state.indices_shown;
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

} // namespace

Json dump_of(Work& work, const ViewState& state) {
    work.session().settle();
    const EditState edit = work.edited();
    Json json;
    json["size"] = {state.size_px.x, state.size_px.y};
    json["layout"] = name_of(state.layout);
    json["alone"] = state.alone ? name_of(*state.alone) : "";
    for (const Places::View& view : places_of(state).views)
        json["panels"][name_of(view.panel)] = box_json(view.box);
    json["tools_open"] = state.tools_open;
    json["help_open"] = state.help_open;
    json["search_open"] = state.search_open;
    json["crosshair_mm"] = json_of(state.crosshair_mm);
    if (const auto at = sample_at(work.subject().grid, state.crosshair_mm))
        json["crosshair_sample"] = {at->x, at->y, at->z};
    json["at_crosshair"] = work.text_at(state.crosshair_mm);
    for (const Panel panel : kPanels) {
        if (!is_slice(panel))
            continue;
        const SliceView& slice = state.slices[static_cast<size_t>(panel)];
        json["slices"][name_of(panel)] = {{"right", json_of(slice.right)},
                                          {"up", json_of(slice.up)},
                                          {"towards", json_of(slice.towards)},
                                          {"center_mm", json_of(slice.center_mm)},
                                          {"zoom", slice.zoom},
                                          {"letters", letters_of(slice.right)}};
    }
    json["camera"] = {{"eye_mm", json_of(state.camera.eye_mm)},
                      {"target_mm", json_of(state.camera.target_mm)},
                      {"up", json_of(state.camera.up)},
                      {"view_angle_deg", state.camera.view_angle_deg}};
    json["window"] = {state.window.low, state.window.high};
    json["tool"] = {
        {"hand", state.tool->name}, {"radius_mm", state.radius_mm}, {"label", state.label}};
    if (state.only_values)
        json["tool"]["only_values"] = {state.only_values->low, state.only_values->high};
    if (state.brush_keeps_to_edges)
        json["tool"]["alike"] = state.alike_deviations;
    dump_mask(state, json);
    json["recovered_steps"] = state.recovered_steps;
    json["labels"] = {{"shown", state.labels_shown},
                      {"opacity", state.label_opacity},
                      {"in_3d", state.labels_in_3d},
                      {"edges", state.label_edges == LabelEdges::smooth ? "smooth" : "voxels"}};
    dump_panels(work, state, json);
    json["slab"] = {{"mm", state.slab_mm}, {"mode", slab_name(state.slab_mode)}};
    json["stereo"] = stereo_json(state);
    json["overlays"] = {{"fusion_opacity", state.fusion_opacity},
                        {"overlay_opacity", state.overlay_opacity},
                        {"outline_px", state.outline_px}};
    json["segment"] = segmenting_json(work, state);
    const PulledMesh* mesh = work.mesh_pulling().mesh();
    json["mesh"] = {{"vertices", mesh ? mesh->mesh().positions.size() : 0},
                    {"pulled", mesh && mesh->is_pulled()},
                    {"label", mesh ? mesh->label() : 0}};
    json["stroke_is_down"] = work.hand().is_drawing();
    json["hand"] = hand_json(work, state);
    json["seen_as"] = name_of(state.seen_as);
    for (const NamedVolume& volume : edit.document.volumes)
        json["document"][volume.name] = fmt::format("{:016x}", content_hash(volume.volume));
    json["undo_steps"] = edit.undo_steps;
    json["redo_steps"] = edit.redo_steps;
    json["refusal"] = edit.refusal;
    return json;
}

} // namespace palpate::view
