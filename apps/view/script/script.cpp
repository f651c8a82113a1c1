#include "apps/view/script/script.h"

#include <algorithm>
#include <sstream>

#include "apps/view/window/panel.h"
#include "engine/base/file.h"
#include "engine/base/json_value.h"

namespace palpate::view {

namespace {

constexpr double kMost_px = 1e5, kFarthest_mm = 1e9, kLongest_s = 1e7;
constexpr uint32_t kMostFrames = 100'000'000;
constexpr std::initializer_list<std::pair<const char*, Button>> kButtonNames{
    {"left", Button::left}, {"middle", Button::middle}, {"right", Button::right}};

glm::dvec2 read_pair(const JsonValue& in, double low, double high) {
    const auto items = in.items(2, 2);
    return items.size() == 2 ? glm::dvec2(items[0].number(low, high), items[1].number(low, high))
                             : glm::dvec2(0.0);
}

glm::uvec2 read_size(const JsonValue& in, glm::uvec2 least) {
    const auto items = in.items(2, 2);
    if (items.size() != 2)
        return kSmallestWindow_px;
    return {items[0].whole_number(least.x, 16384), items[1].whole_number(least.y, 16384)};
}

bool read_flag(const JsonValue& in, const char* key) {
    const auto found = in.find(key);
    return found && found->boolean();
}

constexpr std::initializer_list<std::pair<const char*, Panel>> kViewNames{
    {"axial", Panel::axial},
    {"coronal", Panel::coronal},
    {"sagittal", Panel::sagittal},
    {"3d", Panel::volume}};

// Exactly one of these members.
bool has_one(const JsonValue& in, std::initializer_list<const char*> keys) {
    return std::count_if(keys.begin(), keys.end(),
                         [&](const char* key) { return in.find(key).has_value(); }) == 1;
}

Place read_place(const JsonValue& in) {
    in.only_keys({"widget", "view", "share", "mm", "sample"});
    if (!has_one(in, {"widget", "view"}) || !has_one(in, {"share", "mm", "sample"})) {
        in.complain(
            "expected \"widget\" with \"share\", or \"view\" with \"share\", \"mm\" or \"sample\"");
        return {};
    }
    const auto share = in.find("share");
    if (const auto widget = in.find("widget")) {
        if (!share)
            in.complain("expected \"share\" with \"widget\"");
        return WidgetPlace{widget->text(),
                           share ? read_pair(*share, -kMost_px, kMost_px) : glm::dvec2(0.5)};
    }
    const Panel panel = in.at("view").choice(kViewNames);
    if (share)
        return ViewPlace{panel, read_pair(*share, -kMost_px, kMost_px)};
    const auto mm = in.find("mm");
    return PointPlace{panel, (mm ? *mm : in.at("sample")).vector(-kFarthest_mm, kFarthest_mm), !mm};
}

// The pixels or the place of a move.
void read_move(const JsonValue& in, Script::Line& line) {
    if (in.is(Json::Kind::object))
        line.place = read_place(in);
    else
        line.event.at_px = read_pair(in, -kMost_px, kMost_px);
}

Script::Line read_line(const JsonValue& in) {
    in.only_keys({"frame", "t_s", "move", "button", "key", "down", "wheel", "text", "resize",
                  "drop", "close", "shift", "ctrl", "alt"});
    Script::Line line;
    Event& event = line.event;
    event.modifiers = {read_flag(in, "shift"), read_flag(in, "ctrl"), read_flag(in, "alt")};
    event.down = read_flag(in, "down");
    int kinds = 0;
    const auto is = [&](const char* key, Event::Kind kind) {
        const auto found = in.find(key);
        if (found) {
            ++kinds;
            event.kind = kind;
        }
        return found;
    };
    if (const auto at = is("move", Event::Kind::move))
        read_move(*at, line);
    if (const auto button = is("button", Event::Kind::button))
        event.button = button->choice(kButtonNames);
    if (const auto wheel = is("wheel", Event::Kind::wheel))
        event.wheel = read_pair(*wheel, -1000.0, 1000.0);
    if (const auto key = is("key", Event::Kind::key)) {
        event.key = key->text();
        const auto& names = key_names();
        if (std::find(names.begin(), names.end(), event.key) == names.end())
            key->reject("the name of a key");
    }
    if (const auto text = is("text", Event::Kind::text))
        event.text = text->text();
    if (const auto size = is("resize", Event::Kind::resize))
        event.size_px = read_size(*size, glm::uvec2(0)); // as some window managers have it
    if (const auto drop = is("drop", Event::Kind::drop))
        for (const JsonValue& path : drop->items(1, 10000))
            event.paths.push_back(path.text());
    if (const auto close = is("close", Event::Kind::close); close && !close->boolean())
        close->reject("true");
    if (kinds != 1)
        in.complain(
            "expected one of \"move\", \"button\", \"wheel\", \"key\", \"text\", "
            "\"resize\", \"drop\" and \"close\"");
    return line;
}

Json pair_json(glm::dvec2 pair) {
    return Json{pair.x, pair.y};
}

Json triple_json(glm::dvec3 triple) {
    return Json{triple.x, triple.y, triple.z};
}

Json move_json(const Event& event, const Place& place) {
    if (const auto* widget = std::get_if<WidgetPlace>(&place))
        return Json{{"widget", widget->id}, {"share", pair_json(widget->share)}};
    if (const auto* in_view = std::get_if<ViewPlace>(&place))
        return Json{{"view", name_of(in_view->panel)}, {"share", pair_json(in_view->share)}};
    if (const auto* at = std::get_if<PointPlace>(&place))
        return Json{{"view", name_of(at->panel)},
                    {at->is_sample ? "sample" : "mm", triple_json(at->point)}};
    return pair_json(event.at_px);
}

} // namespace

Result<Script> parse_script(const std::string& text, const std::string& name) {
    Script script{.name = name};
    std::istringstream in(text);
    JsonErrors errors{name, {}};
    bool has_header = false;
    int number = 0;
    for (std::string line; std::getline(in, line) && !errors.first;) {
        ++number;
        if (line.find_first_not_of(" \t\r") == std::string::npos)
            continue;
        const Result<Json> json = parse_json(line, name, number);
        if (!json)
            return tl::unexpected(json.error());
        const JsonValue value(*json, "", errors);
        if (!has_header) {
            has_header = true;
            value.only_keys({"palpate_view", "size", "text_scale"});
            const auto version = value.find("palpate_view");
            if (!version)
                value.complain("expected a header with \"palpate_view\": 2");
            else if (const double found = version->number(0, 1e6); found != 1 && found != 2)
                version->reject("1 or 2, a version of the format");
            if (const auto size = value.find("size"))
                script.size_px = read_size(*size, kSmallestWindow_px);
            if (const auto scale = value.find("text_scale"))
                script.text_scale = scale->number(0.5, 4.0);
            continue;
        }
        Script::Line next = read_line(value);
        if (const auto frame = value.find("frame"))
            next.frame = frame->whole_number(0, kMostFrames);
        else
            value.complain("expected \"frame\", the number of a frame");
        const auto time = value.find("t_s");
        next.event.time_s =
            time ? time->number(0.0, kLongest_s) : static_cast<double>(next.frame) * kFrame_s;
        if (!script.lines.empty()) {
            const Script::Line& last = script.lines.back();
            if (next.frame < last.frame)
                value.complain(
                    fmt::format("expected \"frame\" to be at least {}, that of the line before, "
                                "found {}",
                                last.frame, next.frame));
            else if (next.event.time_s < last.event.time_s)
                value.complain(fmt::format(
                    "expected \"t_s\" to be at least {}, that of the line before, "
                    "found {}{}",
                    last.event.time_s, next.event.time_s, time ? "" : ", of the frame's number"));
        }
        script.lines.push_back(std::move(next));
    }
    if (errors.first)
        return tl::unexpected(*errors.first);
    if (!has_header)
        return fail("{}: expected a header with \"palpate_view\": 2, found an empty file", name);
    return script;
}

Result<Script> load_script(const std::filesystem::path& path) {
    PALPATE_TRY(const std::string text, load_text(path, uint64_t{256} << 20));
    return parse_script(text, path.string());
}

std::string header_line(glm::uvec2 size_px, double text_scale) {
    return json_line(Json{{"palpate_view", 2.0},
                          {"size", pair_json(glm::dvec2(size_px))},
                          {"text_scale", text_scale}}) +
           "\n";
}

std::string event_line(uint64_t frame, const Event& event, const Place& place) {
    Json line{{"frame", frame}, {"t_s", event.time_s}};
    const auto add = [&](const char* key, Json value) {
        line.members.emplace_back(key, std::move(value));
    };
    switch (event.kind) {
        case Event::Kind::move:
            add("move", move_json(event, place));
            break;
        case Event::Kind::button:
            for (const auto& [name, button] : kButtonNames)
                if (button == event.button)
                    add("button", name);
            add("down", event.down);
            break;
        case Event::Kind::wheel:
            add("wheel", pair_json(event.wheel));
            break;
        case Event::Kind::key:
            add("key", event.key);
            add("down", event.down);
            break;
        case Event::Kind::text:
            add("text", event.text);
            break;
        case Event::Kind::resize:
            add("resize", pair_json(glm::dvec2(event.size_px)));
            break;
        case Event::Kind::drop: {
            std::vector<Json> paths;
            for (const std::string& path : event.paths)
                paths.push_back(path);
            add("drop", paths);
            break;
        }
        case Event::Kind::close:
            add("close", true);
            break;
    }
    for (const auto& [name, held] : {std::pair("shift", event.modifiers.shift),
                                     {"ctrl", event.modifiers.ctrl},
                                     {"alt", event.modifiers.alt}})
        if (held)
            add(name, true);
    return json_line(line) + "\n";
}

std::vector<Event> EventQueue::take_frame() {
    size_t count = 0;
    while (count < waiting_.size() && waiting_[count].kind == Event::Kind::move)
        ++count;
    if (count == 0 && !waiting_.empty())
        count = 1;
    std::vector<Event> taken(
        std::make_move_iterator(waiting_.begin()),
        std::make_move_iterator(waiting_.begin() + static_cast<ptrdiff_t>(count)));
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<ptrdiff_t>(count));
    return taken;
}

} // namespace palpate::view
