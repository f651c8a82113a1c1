#include <algorithm>

#include "engine/edit/stroke.h"

namespace palpate {

namespace {

constexpr double kLargestValue = 1e9;

glm::dquat read_turn(const JsonValue& in) {
    const auto items = in.items(4, 4);
    if (items.size() != 4)
        return {1, 0, 0, 0};
    const Result<glm::dquat> turn = unit_turn({items[0].number(-2, 2), items[1].number(-2, 2),
                                               items[2].number(-2, 2), items[3].number(-2, 2)});
    if (!turn)
        in.complain(turn.error().message);
    return turn.value_or(glm::dquat(1, 0, 0, 0));
}

StrokePose read_pose(const JsonValue& in) {
    in.only_keys({"t_s", "p_mm", "q"});
    StrokePose pose;
    const auto t = in.find("t_s"), p = in.find("p_mm");
    if (!p)
        in.complain("expected a pose with \"p_mm\", a list of three numbers");
    else
        pose.tool.position_mm = p->vector(-kFarthest_mm, kFarthest_mm);
    if (t)
        pose.time_s = t->number(-kLongest_s, kLongest_s);
    if (const auto q = in.find("q"))
        pose.tool.rotation = read_turn(*q);
    return pose;
}

Stroke read_header(const JsonValue& in) {
    in.only_keys({"stroke", "units", "shape", "operation"});
    Stroke stroke;
    if (in.find("stroke")->number(0, 1e6) != 1)
        in.complain("expected \"stroke\": 1, the version of the format (not a count)");
    if (const auto units = in.find("units"); !units)
        in.complain("expected \"units\": \"mm\", found none");
    else if (!units->is(Json::Kind::string) || units->json().string != "mm")
        units->reject("\"mm\"");
    const auto shape = in.find("shape"), operation = in.find("operation");
    if (!shape || !operation) {
        in.complain("expected a header with \"shape\" and \"operation\"");
        return stroke;
    }
    stroke.shape = shape->json();
    stroke.tool = read_tool(*shape);
    stroke.operation = read_operation(*operation);
    return stroke;
}

std::vector<RatePoint> read_rates(const JsonValue& in) {
    if (in.is(Json::Kind::number))
        return {{0.0, in.number(0.0, kLargestValue)}};
    std::vector<RatePoint> rates;
    for (const JsonValue& item : in.items(1, 4096)) {
        const auto pair = item.items(2, 2);
        if (pair.size() != 2)
            break;
        rates.push_back(
            {pair[0].number(-kLargestValue, kLargestValue), pair[1].number(0.0, kLargestValue)});
        if (rates.size() > 1 && !(rates[rates.size() - 2].value < rates.back().value))
            item.complain("expected values that rise from pair to pair");
    }
    return rates.empty() ? std::vector<RatePoint>{{0.0, 0.0}} : rates;
}

} // namespace

Operation read_operation(const JsonValue& in) {
    Operation op;
    const auto kind = in.find("kind");
    if (!kind) {
        in.complain("expected an operation with a \"kind\"");
        return op;
    }
    using enum OperationKind;
    op.kind = kind->choice<OperationKind>({{"draw", draw},
                                           {"erase", erase},
                                           {"erode", erode},
                                           {"dilate", dilate},
                                           {"smooth", smooth},
                                           {"fill", fill},
                                           {"islands", islands},
                                           {"cut", cut},
                                           {"mill", mill}});
    switch (op.kind) {
        case draw:
            in.only_keys(
                {"kind", "only_values", "inside", "outside", "spared", "alike", "label", "over"});
            break;
        case erase:
            in.only_keys({"kind", "only_values", "inside", "outside", "spared", "alike", "over"});
            break;
        case erode:
            in.only_keys({"kind", "only_values", "inside", "outside", "spared", "alike", "label",
                          "neighbours"});
            break;
        case dilate:
        case fill:
            in.only_keys({"kind", "only_values", "inside", "outside", "spared", "alike", "label",
                          "over", "neighbours"});
            break;
        case smooth:
            in.only_keys({"kind", "only_values", "inside", "outside", "spared", "alike", "label",
                          "over", "radius_mm"});
            break;
        case islands:
            in.only_keys({"kind", "only_values", "inside", "outside", "spared", "alike", "label",
                          "neighbours", "smallest_mm3"});
            break;
        case cut:
            in.only_keys({"kind", "only_values", "inside", "outside", "spared", "to_value", "walls",
                          "surface_value"});
            break;
        case mill:
            in.only_keys({"kind", "only_values", "inside", "outside", "spared", "to_value", "walls",
                          "surface_value", "falloff_mm", "rate_per_s"});
            break;
    }
    if (uint32_t label = 0; in.take("label", label, 1, 65535))
        op.label = static_cast<uint16_t>(label);
    if (const auto over = in.find("over")) {
        op.over.emplace();
        for (const JsonValue& item : over->items(0, 65536))
            op.over->push_back(static_cast<uint16_t>(item.whole_number(0, 65535)));
    }
    if (const auto spared = in.find("spared"))
        for (const JsonValue& item : spared->items(0, 65535)) {
            op.spared.push_back(static_cast<uint16_t>(item.whole_number(1, 65535)));
            if (op.spared.size() > 1 && op.spared[op.spared.size() - 2] >= op.spared.back())
                item.complain("expected labels that rise");
        }
    op.area = read_area(in);
    if (const auto alike = in.find("alike"))
        op.alike = alike->number(0.0, 100.0);
    if (const auto n = in.find("neighbours")) {
        op.neighbours = static_cast<int>(n->whole_number(0, 100));
        if (op.neighbours != 6 && op.neighbours != 18 && op.neighbours != 26)
            n->reject("6, 18 or 26");
    }
    in.take("radius_mm", op.radius_mm, 0.0, 1e3);
    in.take("smallest_mm3", op.smallest_mm3, 0.0, 1e12);
    if (const auto range = in.find("only_values")) {
        const auto ends = range->items(2, 2);
        if (ends.size() == 2) {
            op.only_values = {ends[0].number(-kLargestValue, kLargestValue),
                              ends[1].number(-kLargestValue, kLargestValue)};
            if (op.only_values->first > op.only_values->second)
                range->complain("expected [low, high] with low <= high");
        }
    }
    if (const auto to = in.find("to_value"))
        op.to_value = to->number(-kLargestValue, kLargestValue);
    if (const auto walls = in.find("walls"))
        op.walls = walls->choice<Walls>({{"smooth", Walls::smooth}, {"samples", Walls::samples}});
    if (const auto surface = in.find("surface_value")) {
        op.surface_value = surface->number(-kLargestValue, kLargestValue);
        if (op.walls == Walls::samples)
            surface->complain("expected \"surface_value\" with smooth walls only");
    }
    in.take("falloff_mm", op.falloff_mm, 0.0, 1e4);
    if (const auto rate = in.find("rate_per_s"))
        op.rates = read_rates(*rate);
    else if (op.kind == mill)
        in.complain("expected \"rate_per_s\", a number or a list of [value, rate]");
    return op;
}

Json operation_json(const Operation& op) {
    using enum OperationKind;
    const OperationKind k = op.kind;
    Json out{{"kind", name_of(k)}};
    const auto add = [&](bool applies, const char* key, Json value) {
        if (applies)
            out[key] = std::move(value);
    };
    add(op.on_labels() && k != erase, "label", op.label);
    if (op.over)
        add(op.overwrites() || k == erase, "over", *op.over);
    add(k == erode || k == dilate || k == fill || k == islands, "neighbours", op.neighbours);
    add(k == smooth, "radius_mm", op.radius_mm);
    add(k == islands, "smallest_mm3", op.smallest_mm3);
    if (!op.spared.empty())
        add(true, "spared", op.spared);
    if (op.only_values)
        add(true, "only_values", Json{op.only_values->first, op.only_values->second});
    if (op.alike)
        add(op.on_labels(), "alike", *op.alike);
    if (!op.area.is_everywhere())
        add(true, op.area.kind == EditArea::Kind::inside ? "inside" : "outside",
            area_labels_json(op.area));
    if (op.to_value)
        add(!op.on_labels(), "to_value", *op.to_value);
    add(!op.on_labels(), "walls", op.walls == Walls::smooth ? "smooth" : "samples");
    if (op.surface_value)
        add(op.smooth_walls(), "surface_value", *op.surface_value);
    add(k == mill, "falloff_mm", op.falloff_mm);
    Json rates = Json::array();
    for (const RatePoint& point : op.rates)
        rates.push_back({point.value, point.per_s});
    add(k == mill, "rate_per_s", rates);
    return out;
}

Result<std::vector<Stroke>> parse_strokes(std::string_view text, const std::string& name) {
    std::vector<Stroke> strokes;
    int line = 0, header_line = 0;
    const auto ended = [&]() -> Result<void> {
        if (!strokes.empty() && strokes.back().poses.empty())
            return fail("{}:{}: expected at least one pose after the header, found none", name,
                        header_line);
        return {};
    };
    for (size_t from = 0; from < text.size();) {
        const size_t end = std::min(text.find('\n', from), text.size());
        const std::string_view row = text.substr(from, end - from);
        from = end + 1;
        ++line;
        if (row.find_first_not_of(" \t\r") == row.npos)
            continue;
        PALPATE_TRY(const Json json, parse_json(row, name, line));
        JsonErrors errors{name, {}};
        const JsonValue value(json, "", errors);
        if (!value.is(Json::Kind::object))
            return fail("{}:{}: expected a header or a pose, found {}", name, line,
                        kind_name(json.kind));
        if (value.find("stroke")) {
            PALPATE_TRY(ended());
            strokes.push_back(read_header(value));
            header_line = line;
        } else if (strokes.empty()) {
            return fail("{}:{}: expected a header with \"stroke\": 1 before the first pose", name,
                        line);
        } else {
            std::vector<StrokePose>& poses = strokes.back().poses;
            const StrokePose pose = read_pose(value);
            if (!errors.first && !poses.empty() && pose.time_s < poses.back().time_s)
                return fail(
                    "{}:{}: expected a time of at least {} s, that of the pose before, "
                    "found {} s",
                    name, line, poses.back().time_s, pose.time_s);
            poses.push_back(pose);
        }
        if (errors.first)
            return tl::unexpected(*errors.first);
    }
    PALPATE_TRY(ended());
    if (strokes.empty())
        return fail("{}: expected a stroke, found none", name);
    return strokes;
}

std::string stroke_text(const Stroke& stroke) {
    std::string text = json_line({{"stroke", 1.0},
                                  {"units", "mm"},
                                  {"shape", stroke.shape},
                                  {"operation", operation_json(stroke.operation)}}) +
                       "\n";
    for (const StrokePose& pose : stroke.poses) {
        Json line{{"t_s", pose.time_s}, {"p_mm", pose.tool.position_mm}};
        if (const glm::dquat q = pose.tool.rotation; q != glm::dquat(1, 0, 0, 0))
            line["q"] = {q.w, q.x, q.y, q.z};
        text += json_line(line) + "\n";
    }
    return text;
}

Result<Stroke> make_stroke(Json shape, Operation operation, std::vector<StrokePose> poses) {
    JsonErrors errors{"shape", {}};
    Stroke stroke;
    stroke.tool = read_tool(JsonValue(shape, "", errors));
    if (errors.first)
        return tl::unexpected(*errors.first);
    if (poses.empty())
        return fail("a stroke: expected at least one pose, found none");
    for (size_t i = 1; i < poses.size(); ++i)
        if (!(poses[i].time_s >= poses[i - 1].time_s))
            return fail("a stroke: expected times that do not fall, found {} s after {} s",
                        poses[i].time_s, poses[i - 1].time_s);
    stroke.shape = std::move(shape);
    stroke.operation = std::move(operation);
    stroke.poses = std::move(poses);
    return stroke;
}

} // namespace palpate
