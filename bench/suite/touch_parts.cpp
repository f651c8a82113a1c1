// The parts that --only names for `palpate bench touch`.

#include <algorithm>
#include <array>

#include "bench/suite/touch.h"

namespace palpate::bench {

namespace {

struct Part {
    const char* name;
    bool TouchParts::*is_asked;
    bool by_default = true;
};
constexpr std::array kParts{
    Part{"open_loop", &TouchParts::open_loop},
    Part{"patients", &TouchParts::patients},
    Part{"closed_loop", &TouchParts::closed_loop},
    Part{"times", &TouchParts::times},
    Part{"laws", &TouchParts::laws},
    Part{"z_width", &TouchParts::z_width},
    Part{"family", &TouchParts::family},
    Part{"family_held", &TouchParts::family_held, false},
};

} // namespace

bool TouchParts::takes(haptics::Takes what) const {
    return std::any_of(algorithms.begin(), algorithms.end(),
                       [&](const haptics::AlgorithmEntry& entry) { return entry.takes(what); });
}

bool TouchParts::has(std::string_view algorithm) const {
    return std::any_of(algorithms.begin(), algorithms.end(),
                       [&](const haptics::AlgorithmEntry& one) { return one.name == algorithm; });
}

std::vector<std::string> TouchParts::names() const {
    std::vector<std::string> names;
    for (const Part& part : kParts)
        if (this->*part.is_asked)
            names.emplace_back(part.name);
    return names;
}

Result<TouchParts> touch_parts(const std::vector<std::string>& only) {
    std::vector<haptics::AlgorithmEntry> everybody; // but those that hold out of nothing
    for (const haptics::AlgorithmEntry& entry : haptics::algorithms())
        if (entry.feels() && !entry.is_guide)
            everybody.push_back(entry);
    const auto is_named = [&](const char* name) {
        return std::find(only.begin(), only.end(), name) != only.end();
    };
    TouchParts asked;
    for (const haptics::AlgorithmEntry& entry : everybody)
        if (is_named(entry.name))
            asked.algorithms.push_back(entry);
    for (const Part& part : kParts)
        asked.*part.is_asked = (only.empty() && part.by_default) || is_named(part.name);

    std::string known;
    for (const Part& part : kParts)
        known += fmt::format("{}, ", part.name);
    for (const haptics::AlgorithmEntry& entry : everybody)
        known += fmt::format("{}{}", entry.name, &entry == &everybody.back() ? "" : ", ");
    for (const std::string& name : only)
        if (!asked.has(name) && std::none_of(kParts.begin(), kParts.end(),
                                             [&](const Part& part) { return part.name == name; }))
            return fail("--only: expected parts of touch ({}), found '{}'", known, name);

    if (asked.algorithms.empty())
        asked.algorithms = std::move(everybody);
    if (asked.names().empty())
        asked.open_loop = true;
    return asked;
}

} // namespace palpate::bench
