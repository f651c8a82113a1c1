#include "engine/scene/presets.h"

#include <algorithm>

#include "engine/base/file.h"

namespace palpate {

namespace {

constexpr double kLargestValue = 1e30; // of a sample
constexpr size_t kMostPoints = 4096;   // of a transfer function

struct Preset {
    std::string_view name;
    TransferFunction function;
};

// Hounsfield units: air -1000, fat -100, water 0, muscle 40 .. 60, contrast-filled vessels
// 150 .. 500, spongy bone from 200, dense bone 700 .. 2000.
const std::vector<Preset>& presets() {
    static const std::vector<Preset> all{
        {"ct-bone",
         {{{110, {0.80, 0.60, 0.44}},
           {200, {0.93, 0.82, 0.66}},
           {450, {0.99, 0.95, 0.86}},
           {1200, {1.0, 0.99, 0.96}}},
          {{110, 0.0}, {190, 0.3}, {300, 0.7}, {1000, 0.92}},
          1.0}},
        {"ct-soft-tissue",
         {{{-300, {0.80, 0.58, 0.40}},
           {-100, {0.92, 0.78, 0.52}},
           {20, {0.78, 0.36, 0.30}},
           {80, {0.85, 0.42, 0.34}},
           {200, {0.93, 0.82, 0.68}},
           {1200, {1.0, 0.98, 0.94}}},
          {{-300, 0.0}, {-100, 0.01}, {0, 0.02}, {40, 0.08}, {150, 0.10}, {300, 0.5}, {1500, 0.9}},
          1.0}},
        {"ct-vessels",
         {{{120, {0.45, 0.02, 0.02}},
           {250, {0.85, 0.10, 0.08}},
           {450, {0.95, 0.42, 0.26}},
           {700, {1.0, 0.92, 0.80}}},
          {{120, 0.0}, {200, 0.25}, {350, 0.5}, {600, 0.5}, {1500, 0.8}},
          1.0}},
        {"ct-skin",
         {{{-500, {0.72, 0.47, 0.37}}, {-150, {0.93, 0.70, 0.58}}, {300, {1.0, 0.87, 0.79}}},
          {{-500, 0.0}, {-350, 0.3}, {-200, 0.7}, {3071, 0.9}},
          1.0}},
        // The points of the comparison with VTK's volume mappers (bench/suite/subject.cpp).
        {"ct-peer",
         {{{-500, {0.62, 0.36, 0.26}},
           {-200, {0.88, 0.60, 0.50}},
           {70, {0.90, 0.62, 0.50}},
           {300, {1.0, 0.94, 0.85}},
           {1200, {1.0, 1.0, 0.95}}},
          {{-1024, 0.0},
           {-500, 0.0},
           {-200, 0.04},
           {70, 0.03},
           {180, 0.08},
           {300, 0.45},
           {1200, 0.85},
           {3071, 0.85}},
          1.0}},
        {"mr",
         {{{150, {0.62, 0.40, 0.32}},
           {400, {0.92, 0.76, 0.64}},
           {700, {0.98, 0.92, 0.85}},
           {1000, {1.0, 1.0, 0.98}}},
          {{180, 0.0}, {300, 0.06}, {500, 0.3}, {1000, 0.6}},
          1.0}},
    };
    return all;
}

// Sorted values, at most two of them equal.
template <class Points>
void check_order(const Points& points, const JsonValue& list) {
    for (size_t i = 1; i < points.size(); ++i) {
        if (points[i].value < points[i - 1].value)
            list.complain(fmt::format("expected points sorted by value, found {} after {}",
                                      points[i].value, points[i - 1].value));
        if (i >= 2 && points[i].value == points[i - 2].value)
            list.complain(fmt::format("expected at most two points of one value, found three at {}",
                                      points[i].value));
    }
}

TransferFunction read_points(const JsonValue& value) {
    value.only_keys({"colors", "opacities", "opacity_unit_mm"});
    TransferFunction function;
    const auto colors = value.find("colors");
    const auto opacities = value.find("opacities");
    if (!colors || !opacities) {
        value.complain(
            fmt::format("expected the key \"{}\", found none", colors ? "opacities" : "colors"));
        return function;
    }
    for (const JsonValue& item : colors->items(1, kMostPoints)) {
        const std::vector<JsonValue> v = item.items(4, 4);
        if (v.size() == 4)
            function.colors.push_back({v[0].number(-kLargestValue, kLargestValue),
                                       {v[1].number(0, 1), v[2].number(0, 1), v[3].number(0, 1)}});
    }
    for (const JsonValue& item : opacities->items(1, kMostPoints)) {
        const std::vector<JsonValue> v = item.items(2, 2);
        if (v.size() == 2)
            function.opacities.push_back(
                {v[0].number(-kLargestValue, kLargestValue), v[1].number(0, 1)});
    }
    check_order(function.colors, *colors);
    check_order(function.opacities, *opacities);
    return function;
}

// Two numbers, the first below the second.
glm::dvec2 read_range(const JsonValue& value) {
    const std::vector<JsonValue> ends = value.items(2, 2);
    if (ends.size() != 2)
        return {0.0, 1.0};
    const double low = ends[0].number(-kLargestValue, kLargestValue);
    const double high = ends[1].number(-kLargestValue, kLargestValue);
    if (!(low < high)) {
        value.complain(
            fmt::format("expected [low, high] with low < high, found [{}, {}]", low, high));
        return {0.0, 1.0};
    }
    return {low, high};
}

TransferFunction read_preset(const JsonValue& name) {
    if (auto found = preset(name.text())) {
        found->opacity_unit_mm = 0.0;
        return *found;
    }
    std::string known;
    for (const std::string_view preset_name : preset_names())
        known += fmt::format("{}{}", known.empty() ? "" : ", ", preset_name);
    name.reject(fmt::format("a preset ({}) or the name of a .json file", known));
    return window_function(0.0, 1.0, 1.0);
}

Result<TransferFunction> load_file(const std::filesystem::path& path) {
    PALPATE_TRY(const std::string text, load_text(path, 1 << 20));
    return parse_transfer_function(text, path.string());
}

} // namespace

const std::vector<std::string_view>& preset_names() {
    static const std::vector<std::string_view> names = [] {
        std::vector<std::string_view> list;
        for (const Preset& entry : presets())
            list.push_back(entry.name);
        return list;
    }();
    return names;
}

std::span<const WindowPreset> window_presets() {
    static constexpr WindowPreset all[] = {
        {"brain", 40, 80},       {"stroke", 40, 40},  {"subdural", 75, 215},
        {"abdomen", 50, 400},    {"liver", 30, 150},  {"mediastinum", 50, 350},
        {"lung", -600, 1500},    {"bone", 400, 1800}, {"temporal-bone", 600, 2800},
        {"soft-tissue", 40, 375}};
    return all;
}

std::optional<TransferFunction> preset(std::string_view name) {
    for (const Preset& entry : presets())
        if (entry.name == name)
            return entry.function;
    return std::nullopt;
}

double preset_unit_mm(const Grid& grid) {
    constexpr double kSmallBody_mm = 200.0, kLargeBody_mm = 2000.0;
    const glm::dmat3 axes(grid.world_from_index);
    double diagonal_mm = 0.0;
    for (const glm::dvec3 sign : {glm::dvec3(1, 1, 1), {-1, 1, 1}, {1, -1, 1}, {1, 1, -1}})
        diagonal_mm = std::max(diagonal_mm, glm::length(axes * (sign * glm::dvec3(grid.size))));
    return diagonal_mm / std::clamp(diagonal_mm, kSmallBody_mm, kLargeBody_mm);
}

TransferFunction sized(TransferFunction function, const Grid& grid) {
    if (function.opacity_unit_mm == 0.0)
        function.opacity_unit_mm = preset_unit_mm(grid);
    return function;
}

TransferFunction stretched(const TransferFunction& function, double low, double high) {
    TransferFunction result = function;
    for (auto& point : result.colors)
        point.value = low + point.value / 1000.0 * (high - low);
    for (auto& point : result.opacities)
        point.value = low + point.value / 1000.0 * (high - low);
    if (low > high) {
        std::reverse(result.colors.begin(), result.colors.end());
        std::reverse(result.opacities.begin(), result.opacities.end());
    }
    return result;
}

TransferFunction read_transfer_function(const JsonValue& value,
                                        const std::filesystem::path& folder) {
    const TransferFunction fallback = window_function(0.0, 1.0, 1.0);
    if (value.is(Json::Kind::string)) {
        const std::string name = value.text();
        if (preset(name) || !name.ends_with(".json"))
            return read_preset(value);
        Result<TransferFunction> loaded = load_file(folder / name);
        if (loaded)
            return *loaded;
        value.complain(loaded.error().message);
        return fallback;
    }
    if (!value.is(Json::Kind::object)) {
        value.reject("a preset's name, a file's name or an object");
        return fallback;
    }
    TransferFunction function;
    if (const auto name = value.find("preset")) {
        value.only_keys({"preset", "range", "opacity_unit_mm"});
        function = read_preset(*name);
        if (const auto range = value.find("range")) {
            const glm::dvec2 ends = read_range(*range);
            function = stretched(function, ends.x, ends.y);
        }
    } else if (const auto window = value.find("window")) {
        value.only_keys({"window", "max_opacity", "opacity_unit_mm"});
        const glm::dvec2 ends = read_range(*window);
        const auto opacity = value.find("max_opacity");
        function = window_function(ends.x, ends.y, opacity ? opacity->number(0.0, 1.0) : 1.0);
    } else {
        function = read_points(value);
    }
    value.take("opacity_unit_mm", function.opacity_unit_mm, 0.0, 1e6);
    return function.colors.empty() || function.opacities.empty() ? fallback : function;
}

Json transfer_function_json(const TransferFunction& function) {
    Json colors = Json::array();
    for (const auto& point : function.colors)
        colors.push_back({point.value, point.color.x, point.color.y, point.color.z});
    Json opacities = Json::array();
    for (const auto& point : function.opacities)
        opacities.push_back({point.value, point.opacity});
    return {{"colors", std::move(colors)},
            {"opacities", std::move(opacities)},
            {"opacity_unit_mm", function.opacity_unit_mm}};
}

Result<TransferFunction> parse_transfer_function(std::string_view text, const std::string& name) {
    PALPATE_TRY(const Json json, parse_json(text, name));
    JsonErrors errors{name, {}};
    const JsonValue root(json, "", errors);
    if (!root.is(Json::Kind::object))
        root.reject("an object");
    TransferFunction function = read_transfer_function(root, {});
    if (errors.first)
        return tl::unexpected<Error>(*errors.first);
    return function;
}

Result<TransferFunction> load_transfer_function(const std::filesystem::path& path) {
    if (auto found = preset(path.string())) {
        found->opacity_unit_mm = 0.0;
        return *found;
    }
    return load_file(path);
}

} // namespace palpate
