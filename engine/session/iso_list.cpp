#include "engine/session/iso_list.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace palpate {

Json iso_list_json(const IsoList& list) {
    Json json = Json::array();
    for (const ListedIso& one : list)
        json.push_back({{"value", one.surface.value},
                        {"color", one.surface.color},
                        {"opacity", one.surface.opacity},
                        {"name", one.name},
                        {"shown", one.shown}});
    return json;
}

IsoList read_iso_list(const JsonValue& in) {
    IsoList list;
    for (const JsonValue& item : in.items(0, kMostListed)) {
        if (!item.only_keys({"value", "color", "opacity", "name", "shown"}))
            continue;
        ListedIso one{};
        item.take("value", one.surface.value, -1e30, 1e30);
        if (const auto color = item.find("color"))
            one.surface.color = color->vector(0.0, 1.0);
        if (const auto opacity = item.find("opacity"))
            one.surface.opacity = opacity->number_above(0.0, 1.0);
        item.take("name", one.name);
        item.take("shown", one.shown);
        if (is_listed(list, one.surface.value))
            item.complain(
                fmt::format("expected values that differ, found {} twice", one.surface.value));
        list.push_back(std::move(one));
    }
    if (shown_surfaces(list).size() > kMaxIsos)
        in.complain(fmt::format("expected at most {} surfaces that are shown, found {}", kMaxIsos,
                                shown_surfaces(list).size()));
    return list;
}

IsoList followed(IsoList list, const std::vector<IsoSurface>& seen) {
    std::vector<size_t> ours, theirs; // without a partner of the same value
    std::vector<char> is_met(seen.size(), 0);
    for (size_t i = 0; i < list.size(); ++i) {
        if (!list[i].shown)
            continue;
        size_t k = 0;
        while (k < seen.size() && (is_met[k] || seen[k].value != list[i].surface.value))
            ++k;
        if (k == seen.size()) {
            ours.push_back(i);
            continue;
        }
        is_met[k] = 1;
        list[i].surface = seen[k];
    }
    for (size_t k = 0; k < seen.size(); ++k)
        if (!is_met[k])
            theirs.push_back(k);
    if (ours.size() == theirs.size()) {
        for (size_t n = 0; n < ours.size(); ++n)
            list[ours[n]].surface = seen[theirs[n]];
    } else {
        for (size_t n = ours.size(); n-- > 0;)
            list.erase(list.begin() + static_cast<ptrdiff_t>(ours[n]));
        for (const size_t k : theirs)
            list.push_back({seen[k]});
    }
    return list;
}

std::vector<IsoSurface> shown_surfaces(const IsoList& list) {
    std::vector<IsoSurface> shown;
    for (const ListedIso& one : list)
        if (one.shown)
            shown.push_back(one.surface);
    std::stable_sort(shown.begin(), shown.end(),
                     [](const IsoSurface& a, const IsoSurface& b) { return a.value < b.value; });
    shown.erase(
        std::unique(shown.begin(), shown.end(),
                    [](const IsoSurface& a, const IsoSurface& b) { return a.value == b.value; }),
        shown.end());
    return shown;
}

bool is_listed(const IsoList& list, double value) {
    return std::any_of(list.begin(), list.end(),
                       [&](const ListedIso& one) { return one.surface.value == value; });
}

bool add_iso(IsoList& list, ListedIso one) {
    if (list.size() >= kMostListed)
        return false;
    while (is_listed(list, one.surface.value))
        one.surface.value = std::nextafter(one.surface.value, HUGE_VAL);
    one.shown = one.shown && shown_surfaces(list).size() < kMaxIsos;
    list.push_back(std::move(one));
    return true;
}

} // namespace palpate
