#include "engine/program/touch_texts.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "engine/base/file.h"
#include "engine/base/json_value.h"
#include "engine/program/option_texts.h"
#include "haptics/field/coupling.h"

namespace palpate {

using haptics::HapticTransfer;
using haptics::LabelTouch;
using haptics::MostTouch;

namespace {

// VALUE:FORCE pairs of rising value, or with `sigmoid` A or A,CENTER,WIDTH.
Result<HapticTransfer> read_pairs(const std::string& text, bool sigmoid) {
    HapticTransfer transfer;
    if (text.empty())
        return transfer;
    if (sigmoid && text.find(':') == std::string::npos) {
        const auto n = numbers_of(text, ',');
        if (!n || (n->size() != 1 && n->size() != 3))
            return fail("expected A or A,CENTER,WIDTH or VALUE:FORCE pairs, found '{}'", text);
        transfer.strength_n = n->front();
        if (n->size() == 3) {
            transfer.center = (*n)[1];
            transfer.width = (*n)[2];
        }
        return transfer;
    }
    for (size_t begin = 0; begin <= text.size();) {
        const size_t end = std::min(text.find(',', begin), text.size());
        const std::string_view pair = std::string_view(text).substr(begin, end - begin);
        const auto n = numbers_of(pair, ':');
        if (!n || n->size() != 2)
            return fail("expected a VALUE:NUMBER pair, found '{}'", pair);
        if (transfer.point_count == HapticTransfer::kMostPoints)
            return fail("expected at most {} pairs, found more", HapticTransfer::kMostPoints);
        if (transfer.point_count > 0 && n->front() <= transfer.values[transfer.point_count - 1])
            return fail("expected values that rise from pair to pair, found '{}'", text);
        transfer.values[transfer.point_count] = n->front();
        transfer.forces_n[transfer.point_count++] = n->back();
        begin = end + 1;
    }
    return transfer;
}

Result<HapticTransfer> read_transfer(const std::string& text, bool sigmoid) {
    Result<HapticTransfer> transfer = read_pairs(text, sigmoid);
    if (transfer && !haptics::is_sane(*transfer))
        return fail("expected numbers of at most {:g}, at values within {:g}, found '{}'",
                    MostTouch::force_n, MostTouch::value, text);
    return transfer;
}

} // namespace

Result<HapticTransfer> read_force(const std::string& text) {
    return read_transfer(text, true);
}

Result<HapticTransfer> read_opacity(const std::string& text) {
    return read_transfer(text, false);
}

Result<LabelTouch> read_label(const std::string& text) {
    const auto n = numbers_of(text, ',');
    const bool whole =
        n && n->front() >= 0.0 && n->front() <= 65535.0 && n->front() == std::floor(n->front());
    if (!whole || n->size() < 2 || n->size() > 4 ||
        std::any_of(n->begin(), n->end(), [](double v) { return v < 0.0; }))
        return fail("expected LABEL,STIFFNESS[,FRICTION[,T0]], found '{}'", text);
    LabelTouch touch{.label = static_cast<uint32_t>(n->front()), .stiffness_n_per_m = (*n)[1]};
    if (n->size() > 2)
        touch.friction_static = touch.friction_dynamic = (*n)[2];
    if (n->size() > 3)
        touch.yield_n = (*n)[3];
    if (!haptics::is_sane(touch))
        return fail("expected at most {:g} N/m, a friction of {:g} and {:g} N, found '{}'",
                    MostTouch::stiffness_n_per_m, MostTouch::friction, MostTouch::force_n, text);
    return touch;
}

bool is_json(const std::string& text) {
    return text.find('{') != std::string::npos;
}

namespace {

template <class T>
Result<Said<T>> read_json(const std::string& text, T (*read)(const JsonValue&)) {
    std::string content = text;
    if (!is_json(text)) {
        PALPATE_TRY(content, load_text(text));
    }
    const std::string name = is_json(text) ? "JSON" : text;
    PALPATE_TRY(Json json, parse_json(content, name));
    JsonErrors errors{name, {}};
    T value = read(JsonValue(json, "", errors));
    if (errors.first)
        return tl::unexpected(*errors.first);
    return Said<T>{std::move(json), std::move(value)};
}

} // namespace

Result<Said<Tool>> read_touch_tool(const std::string& text) {
    return read_json(text, read_tool);
}

Result<Said<Operation>> read_touch_operation(const std::string& text) {
    Result<Said<Operation>> operation = read_json(text, read_operation);
    if (operation && operation->value.by_region())
        return fail("'{}' takes effect after the stroke and cannot be felt",
                    name_of(operation->value.kind));
    return operation;
}

} // namespace palpate
