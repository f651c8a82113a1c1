#include "apps/view/panels/search.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <sstream>

#include "apps/view/document/label_changes.h"
#include "apps/view/panels/widget_help.h"
#include "apps/view/tools/tool.h"
#include "apps/view/window/keys.h"
#include "engine/segment/methods.h"
#include "haptics/field/touch_parameters.h"

namespace palpate::view {

namespace {

std::string lower(std::string text) {
    for (char& letter : text)
        letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
    return text;
}

// How well a word fits, 0 the best; none: it does not occur. A word counts where one begins, so
// that "all" does not find "wall".
std::optional<int> rank_of(const std::string& word, const Findable& one) {
    const auto begins_in = [&](const std::string& text) -> std::optional<size_t> {
        const std::string in = lower(text);
        for (size_t at = in.find(word); at != std::string::npos; at = in.find(word, at + 1))
            if (at == 0 || !std::isalnum(static_cast<unsigned char>(in[at - 1])))
                return at;
        return std::nullopt;
    };
    if (const auto at = begins_in(one.title))
        return *at == 0 ? 0 : 1;
    if (begins_in(one.also))
        return 2;
    if (begins_in(one.help) || begins_in(one.kind))
        return 3;
    return std::nullopt;
}

} // namespace

std::vector<Findable> findables(const Subject& subject, const haptics::AlgorithmEntry* algorithm) {
    std::vector<Findable> all;
    for (const Tool* tool : tools())
        if (tool->title)
            all.push_back(
                {tool->title, "tool", tool->help, tool->key ? key_of(*tool) : "", "", "",
                 [tool](Outcome& next, const Subject&) { choose_tool(next.state, *tool); }});
    const auto titled = [](const std::string& title) {
        return std::find_if(widget_help().begin(), widget_help().end(), [&](const WidgetHelp& one) {
            return one.always && title == one.title;
        });
    };
    const std::vector<KeyCommand> keys = key_commands();
    for (const KeyCommand& command : keys) {
        const auto same = titled(command.title);
        const bool has = same != widget_help().end();
        all.push_back({command.title, "key", has ? same->help : "", command.keys,
                       has ? same->also : "", "",
                       [press = command.press](Outcome& next, const Subject& in) {
                           use_key(next, press, in);
                       }});
    }
    for (size_t i = 0; i < subject.windows.size() && i < subject.window_names.size(); ++i)
        all.push_back({fmt::format("window: {}", subject.window_names[i]), "window",
                       "values from black to white in slices", i < 9 ? std::to_string(i + 1) : "",
                       "level preset contrast", "", [i](Outcome& next, const Subject& in) {
                           if (i < in.windows.size())
                               next.state.window = in.windows[i];
                       }});
    for (const LabelChange& change : label_changes())
        if (const WidgetHelp* help = help_of(fmt::format("labels/{}", change.id)))
            all.push_back({fmt::format("label: {}", change.title), "command", help->help, "",
                           help->also, "", [&change](Outcome& next, const Subject&) {
                               next.orders.push_back(order::ChangeLabel{&change});
                           }});
    const auto show = [](std::string id) {
        return [id](Outcome& next, const Subject&) { open_panel_of(next.state, id); };
    };
    for (const WidgetHelp& one : widget_help())
        if (one.always && std::none_of(keys.begin(), keys.end(), [&](const KeyCommand& command) {
                return std::string_view(command.title) == one.title;
            }))
            all.push_back({one.title, "setting", one.help, "", one.also, one.id, show(one.id)});
    for (const SegmentMethod& method : segment_methods())
        if (!method.takes_curves) // the window has none
            all.push_back({method.name, "method", method.purpose, "", "segment segmentation",
                           "segment/methods", [&method](Outcome& next, const Subject&) {
                               open_panel_of(next.state, "segment/methods");
                               next.state.segmenting.method = method.name;
                           }});
    for (const auto& setting : haptics::kTouchSettings)
        if (setting.use.slider.label && algorithm && algorithm->feels() &&
            is_read_by(setting, algorithm->bits)) {
            const std::string id = fmt::format("touch/{}", setting.use.slider.label);
            all.push_back(
                {fmt::format("touch: {}", setting.use.slider.label), "setting",
                 fmt::format("{}{}{}", setting.help, *setting.unit ? ", " : "", setting.unit), "",
                 "haptic hand force", id, show(id)});
        }
    return all;
}

std::vector<size_t> found(const std::vector<Findable>& all, const std::string& text) {
    std::vector<std::pair<int, size_t>> fits;
    for (size_t i = 0; i < all.size(); ++i) {
        std::istringstream words(lower(text));
        int rank = 0;
        bool has_all = true;
        for (std::string word; has_all && words >> word;) {
            const auto one = rank_of(word, all[i]);
            has_all = one.has_value();
            rank += one.value_or(0);
        }
        if (lower(text) == lower(all[i].title))
            rank = -1;
        if (has_all)
            fits.emplace_back(rank, i);
    }
    std::stable_sort(fits.begin(), fits.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<size_t> places;
    for (const auto& [rank, place] : fits)
        places.push_back(place);
    return places;
}

} // namespace palpate::view
