#include "engine/edit/edit_mask.h"

#include <algorithm>
#include <charconv>

#include "engine/edit/operation.h"

namespace palpate {

bool EditArea::has(uint16_t label) const {
    if (kind == Kind::everywhere)
        return true;
    const bool listed =
        labels.empty() ? label != 0 : std::binary_search(labels.begin(), labels.end(), label);
    return listed == (kind == Kind::inside);
}

std::vector<bool> EditArea::table() const {
    std::vector<bool> table(65536);
    for (size_t label = 0; label < table.size(); ++label)
        table[label] = has(static_cast<uint16_t>(label));
    return table;
}

Result<Operation> within_mask(Operation operation, const EditMask& mask) {
    const char* name = name_of(operation.kind);
    if (!mask.area.is_everywhere()) {
        if (!operation.area.is_everywhere() && operation.area != mask.area)
            return fail("{}: the stroke has an area of its own, and the mask has another", name);
        operation.area = mask.area;
    }
    if (mask.values) {
        auto& values = operation.only_values;
        const auto both = !values ? *mask.values
                                  : std::pair(std::max(values->first, mask.values->first),
                                              std::min(values->second, mask.values->second));
        if (!(both.first <= both.second))
            return fail("{}: the stroke is of values {} to {}, the mask of {} to {}", name,
                        values->first, values->second, mask.values->first, mask.values->second);
        values = both;
    }
    if (mask.over && operation.overwrites()) {
        if (!operation.over) {
            operation.over = mask.over;
        } else {
            std::erase_if(*operation.over, [&](uint16_t label) {
                return std::ranges::find(*mask.over, label) == mask.over->end();
            });
            if (operation.over->empty())
                return fail("{}: the stroke may overwrite no label that the mask leaves open",
                            name);
        }
    }
    return operation;
}

EditArea read_area(const JsonValue& in) {
    EditArea area;
    const auto inside = in.find("inside"), outside = in.find("outside");
    if (inside && outside)
        outside->complain("expected \"inside\" or \"outside\", found both");
    if (!inside && !outside)
        return area;
    const JsonValue& of = inside ? *inside : *outside;
    area.kind = inside ? EditArea::Kind::inside : EditArea::Kind::outside;
    if (of.is(Json::Kind::string)) {
        if (of.json().string != "any")
            of.reject("\"any\" or a list of labels");
        return area;
    }
    for (const JsonValue& item : of.items(1, 65535)) {
        area.labels.push_back(static_cast<uint16_t>(item.whole_number(1, 65535)));
        if (area.labels.size() > 1 && area.labels[area.labels.size() - 2] >= area.labels.back())
            item.complain("expected labels that rise");
    }
    return area;
}

Result<std::vector<uint16_t>> labels_between_commas(const std::string& text, uint16_t least) {
    std::vector<uint16_t> labels;
    for (size_t from = 0; from <= text.size();) {
        const size_t end = std::min(text.find(',', from), text.size());
        uint16_t label = 0;
        const char *const first = text.data() + from, *const last = text.data() + end;
        const auto [stop, error] = std::from_chars(first, last, label);
        if (error != std::errc() || stop != last || label < least)
            return fail("expected labels from {} to 65535 between commas, found '{}'", least, text);
        labels.push_back(label);
        from = end + 1;
    }
    std::ranges::sort(labels);
    labels.erase(std::unique(labels.begin(), labels.end()), labels.end());
    return labels;
}

Result<EditArea> area_named(EditArea::Kind kind, const std::string& labels) {
    if (labels == "any")
        return EditArea{kind, {}};
    PALPATE_TRY(std::vector<uint16_t> listed, labels_between_commas(labels, 1));
    return EditArea{kind, std::move(listed)};
}

Json area_labels_json(const EditArea& area) {
    return area.labels.empty() ? Json("any") : Json(area.labels);
}

} // namespace palpate
