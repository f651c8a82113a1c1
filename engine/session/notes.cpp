#include "engine/session/notes.h"

#include <algorithm>
#include <utility>

namespace palpate {

namespace {

constexpr size_t kMostMeasures = 100000, kMostLabels = 65536, kMostPlanes = 4096;
constexpr double kFarthest = 1e300;

// Null where there is nothing in the list.
Json or_null(Json list) {
    return list.items.empty() ? Json() : list;
}

template <class Values, class Write>
Json list_of(const Values& values, Write write) {
    Json list = Json::array();
    for (const auto& value : values)
        list.push_back(write(value));
    return or_null(std::move(list));
}

Json name_json(const LabelName& name) {
    Json entry{{"label", name.label}, {"name", name.name}};
    if (name.color)
        entry["color"] = *name.color;
    return entry;
}

Json style_json(const std::pair<const uint32_t, LabelStyle>& style) {
    Json entry{
        {"label", style.first}, {"color", style.second.color}, {"visible", style.second.visible}};
    if (style.second.opacity != 1.0)
        entry["opacity"] = style.second.opacity;
    return entry;
}

Json plane_json(const ClipPlane& plane) {
    return {{"point_mm", plane.point_mm}, {"normal", plane.normal}};
}

std::vector<JsonValue> items_of(const JsonValue& in, const char* key, size_t most) {
    const auto list = in.find(key);
    return list && !list->is(Json::Kind::null) ? list->items(0, most) : std::vector<JsonValue>();
}

LabelName read_name(const JsonValue& in) {
    in.only_keys({"label", "name", "color"});
    LabelName name;
    name.label = in.at("label").whole_number(0, 65535);
    in.take("name", name.name);
    if (const auto color = in.find("color"))
        name.color = color->vector(0.0, 1.0);
    return name;
}

ClipPlane read_plane(const JsonValue& in) {
    in.only_keys({"point_mm", "normal"});
    return {in.at("point_mm").vector(-1e9, 1e9), in.at("normal").direction()};
}

// A member that is an object; nothing where it is null or not there.
std::optional<JsonValue> object_in(const JsonValue& in, const char* key) {
    const auto member = in.find(key);
    return member && !member->is(Json::Kind::null) ? member : std::nullopt;
}

} // namespace

Json notes_json(const Notes& notes) {
    Json json = Json::object();
    json["label_names"] = list_of(notes.label_names, name_json);
    json["label_styles"] = list_of(notes.label_styles, style_json);
    json["locked_labels"] = or_null(notes.locked_labels);
    json["measures"] = list_of(notes.measures, measure_json);
    json["clip_planes"] = list_of(notes.clip_planes, plane_json);
    json["bound"] = notes.bound ? Json{{"method", notes.bound->method},
                                       {"strength", notes.bound->strength},
                                       {"value", notes.bound->value}}
                                : Json();
    json["window"] = notes.window ? Json{{"low", notes.window->low},
                                         {"high", notes.window->high},
                                         {"inverted", notes.window->is_inverted}}
                                  : Json();
    return json;
}

Notes read_notes(const JsonValue& in) {
    Notes notes;
    for (const JsonValue& entry : items_of(in, "label_names", kMostLabels))
        notes.label_names.push_back(read_name(entry));
    for (const JsonValue& entry : items_of(in, "label_styles", kMostLabels)) {
        entry.only_keys({"label", "color", "visible", "opacity"});
        LabelStyle& style = notes.label_styles[entry.at("label").whole_number(0, 65535)];
        style.color = entry.at("color").vector(0.0, 1.0);
        entry.take("visible", style.visible);
        entry.take("opacity", style.opacity, 0.0, 1.0);
    }
    for (const JsonValue& label : items_of(in, "locked_labels", kMostLabels))
        notes.locked_labels.push_back(static_cast<uint16_t>(label.whole_number(1, 65535)));
    std::sort(notes.locked_labels.begin(), notes.locked_labels.end());
    for (const JsonValue& measure : items_of(in, "measures", kMostMeasures))
        notes.measures.push_back(read_measure(measure));
    for (const JsonValue& plane : items_of(in, "clip_planes", kMostPlanes))
        notes.clip_planes.push_back(read_plane(plane));
    if (const auto bound = object_in(in, "bound")) {
        bound->only_keys({"method", "strength", "value"});
        notes.bound = {bound->at("method").text(), bound->at("strength").text(),
                       bound->at("value").number(-kFarthest, kFarthest)};
    }
    if (const auto window = object_in(in, "window")) {
        window->only_keys({"low", "high", "inverted"});
        Notes::Window& read = notes.window.emplace();
        read.low = window->at("low").number(-kFarthest, kFarthest);
        read.high = window->at("high").number_above(read.low, kFarthest);
        window->take("inverted", read.is_inverted);
    }
    return notes;
}

NotePages pages_of(const Notes& notes) {
    NotePages::Texts texts;
    for (const auto& [page, value] : notes_json(notes).members)
        texts[page] = json_line(value);
    return NotePages(std::move(texts));
}

Result<Notes> notes_of(const NotePages& pages) {
    Json json = Json::object();
    for (const auto& [page, text] : pages.texts()) {
        PALPATE_TRY(json[page], parse_json(text, "notes: " + page));
    }
    JsonErrors errors{"notes", {}};
    Notes notes = read_notes(JsonValue(json, "", errors));
    if (errors.first)
        return tl::unexpected(*errors.first);
    return notes;
}

LabelStyle style_of(const Notes& notes, uint32_t label) {
    const auto own = notes.label_styles.find(label);
    return own == notes.label_styles.end() ? style_of(LabelLayer{}, label) : own->second;
}

void set_style(Notes& notes, uint32_t label, const LabelStyle& style) {
    if (style == style_of(LabelLayer{}, label))
        notes.label_styles.erase(label);
    else
        notes.label_styles[label] = style;
}

void name_label(Notes& notes, uint32_t label, const std::string& name) {
    auto& names = notes.label_names;
    const auto known = std::ranges::find(names, label, &LabelName::label);
    if (known == names.end()) {
        if (!name.empty())
            names.push_back({label, name, {}});
    } else if (name.empty() && !known->color) {
        names.erase(known);
    } else {
        known->name = name;
    }
}

std::string name_of_label(const Notes& notes, uint32_t label) {
    const auto known = std::ranges::find(notes.label_names, label, &LabelName::label);
    return known == notes.label_names.end() ? std::string() : known->name;
}

std::string numbered_name(const Notes& notes, uint32_t label) {
    const std::string name = name_of_label(notes, label);
    return name.empty() ? std::to_string(label) : fmt::format("{} {}", label, name);
}

void take_from_scene(Notes& notes, const Scene& scene) {
    notes.clip_planes = scene.clip_planes;
    for (ClipPlane& plane : notes.clip_planes)
        plane.normal = glm::normalize(plane.normal);
    notes.label_styles.clear();
    if (!scene.labels)
        return;
    for (uint32_t label = 1; label < scene.labels->styles.size(); ++label)
        if (const LabelStyle& style = scene.labels->styles[label];
            style != style_of(LabelLayer{}, label))
            notes.label_styles[label] = style;
}

void show_in_scene(const Notes& notes, Scene& scene) {
    scene.clip_planes = notes.clip_planes;
    if (!scene.labels)
        return;
    std::vector<LabelStyle>& styles = scene.labels->styles;
    const uint32_t own = notes.label_styles.empty() ? 0 : notes.label_styles.rbegin()->first;
    styles.resize(std::min<size_t>(styles.size(), own + 1));
    for (uint32_t label = 0; label < styles.size(); ++label)
        styles[label] = style_of(notes, label);
    while (!notes.label_styles.empty() && styles.size() <= own)
        styles.push_back(style_of(notes, static_cast<uint32_t>(styles.size())));
}

Result<NotePages> with_notes_of_scene(const NotePages& pages, const Scene& scene) {
    PALPATE_TRY(Notes notes, notes_of(pages));
    take_from_scene(notes, scene);
    return pages_of(notes).with(pages.texts());
}

Result<void> show_pages(const NotePages& pages, Scene& scene) {
    PALPATE_TRY(const NotePages all, with_notes_of_scene(pages, scene));
    PALPATE_TRY(const Notes notes, notes_of(all));
    show_in_scene(notes, scene);
    return {};
}

} // namespace palpate
