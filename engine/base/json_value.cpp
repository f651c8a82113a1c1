#include "engine/base/json_value.h"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {

std::string shown(const Json& json) {
    switch (json.kind) {
        case Json::Kind::number:
            return fmt::format("{}", json.number);
        case Json::Kind::boolean:
            return json.boolean ? "true" : "false";
        case Json::Kind::string:
            return fmt::format("\"{}\"", json.string.size() > 60 ? json.string.substr(0, 60) + "..."
                                                                 : json.string);
        case Json::Kind::array:
            return fmt::format("a list of {}", json.items.size());
        default:
            return kind_name(json.kind);
    }
}

// Letters to insert, delete or replace, or neighbours to swap: Levenshtein's distance with swaps.
size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::vector<size_t>> d(a.size() + 1, std::vector<size_t>(b.size() + 1));
    for (size_t i = 0; i <= a.size(); ++i)
        for (size_t j = 0; j <= b.size(); ++j) {
            if (i == 0 || j == 0) {
                d[i][j] = i + j;
                continue;
            }
            d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1,
                                d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
        }
    return d[a.size()][b.size()];
}

} // namespace

std::string_view nearest_name(std::string_view name, const std::vector<std::string_view>& known) {
    std::string_view best;
    size_t best_distance = ~size_t{0};
    if (name.size() > 64)
        return best;
    for (const std::string_view candidate : known) {
        const size_t distance = edit_distance(name, candidate);
        if (distance < best_distance && 3 * distance <= std::max(candidate.size(), size_t{3})) {
            best = candidate;
            best_distance = distance;
        }
    }
    return best;
}

void JsonValue::complain(const std::string& sentence) const {
    if (!errors_->first)
        errors_->first = Error{fmt::format("{}:{}: {}{}{}", errors_->file, json_->line, place_,
                                           place_.empty() ? "" : ": ", sentence)};
}

void JsonValue::reject(const std::string& expected) const {
    complain(fmt::format("expected {}, found {}", expected, shown(*json_)));
}

std::string JsonValue::one_of(const std::vector<std::string_view>& names) {
    std::string text = "one of";
    for (size_t i = 0; i < names.size(); ++i)
        text += fmt::format("{} \"{}\"", i == 0 ? "" : ",", names[i]);
    return text;
}

std::optional<JsonValue> JsonValue::find(std::string_view key) const {
    const Json* member = json_->find(key);
    if (member == nullptr)
        return std::nullopt;
    return JsonValue(*member, place_ + (place_.empty() ? "" : ".") + std::string(key), *errors_);
}

JsonValue JsonValue::at(std::string_view key) const {
    static const Json none;
    if (const auto member = find(key))
        return *member;
    complain(fmt::format("expected the key \"{}\", found none", key));
    return JsonValue(none, std::string(key), *errors_);
}

bool JsonValue::take(std::string_view key, double& out, double low, double high) const {
    const auto value = find(key);
    if (value)
        out = value->number(low, high);
    return value.has_value();
}

bool JsonValue::take(std::string_view key, uint32_t& out, uint32_t low, uint32_t high) const {
    const auto value = find(key);
    if (value)
        out = value->whole_number(low, high);
    return value.has_value();
}

bool JsonValue::take(std::string_view key, bool& out) const {
    const auto value = find(key);
    if (value)
        out = value->boolean();
    return value.has_value();
}

bool JsonValue::take(std::string_view key, std::string& out) const {
    const auto value = find(key);
    if (value)
        out = value->text();
    return value.has_value();
}

bool JsonValue::only_keys(const std::vector<std::string_view>& keys) const {
    if (!is(Json::Kind::object)) {
        reject("an object");
        return false;
    }
    for (const auto& [name, value] : json_->members)
        if (std::find(keys.begin(), keys.end(), name) == keys.end()) {
            const std::string_view near = nearest_name(name, keys);
            std::string hint;
            if (near.empty()) {
                hint = "known keys:";
                for (const std::string_view key : keys)
                    hint += fmt::format("{} {}", key == keys.front() ? "" : ",", key);
            } else {
                hint = fmt::format("did you mean \"{}\"?", near);
            }
            const std::string shown_name = name.size() > 60 ? name.substr(0, 60) + "..." : name;
            JsonValue(value, place_, *errors_)
                .complain(fmt::format("unknown key \"{}\"; {}", shown_name, hint));
            return false;
        }
    return true;
}

std::vector<JsonValue> JsonValue::items(size_t least, size_t most) const {
    std::vector<JsonValue> found;
    if (!is(Json::Kind::array) || json_->items.size() < least || json_->items.size() > most) {
        reject(least == most ? fmt::format("a list of {}", least)
                             : fmt::format("a list of {} to {}", least, most));
        return found;
    }
    for (size_t i = 0; i < json_->items.size(); ++i)
        found.emplace_back(json_->items[i], fmt::format("{}[{}]", place_, i), *errors_);
    return found;
}

double JsonValue::number(double low, double high) const {
    if (is(Json::Kind::number) && json_->number >= low && json_->number <= high)
        return json_->number;
    reject(fmt::format("a number from {} to {}", low, high));
    return low;
}

double JsonValue::number_above(double low, double high) const {
    if (is(Json::Kind::number) && json_->number > low && json_->number <= high)
        return json_->number;
    reject(fmt::format("a number above {}, up to {}", low, high));
    return high;
}

uint32_t JsonValue::whole_number(uint32_t low, uint32_t high) const {
    if (is(Json::Kind::number) && json_->number >= low && json_->number <= high &&
        json_->number == std::floor(json_->number))
        return static_cast<uint32_t>(json_->number);
    reject(fmt::format("a whole number from {} to {}", low, high));
    return low;
}

bool JsonValue::boolean() const {
    if (!is(Json::Kind::boolean))
        reject("true or false");
    return json_->boolean;
}

std::string JsonValue::text() const {
    if (!is(Json::Kind::string))
        reject("a text");
    return json_->string;
}

glm::dvec3 JsonValue::vector(double low, double high) const {
    glm::dvec3 value{};
    const std::vector<JsonValue> parts = items(3, 3);
    for (size_t i = 0; i < parts.size(); ++i)
        value[static_cast<int>(i)] = parts[i].number(low, high);
    return value;
}

glm::dvec3 JsonValue::direction() const {
    const glm::dvec3 value = vector(-1e9, 1e9);
    // Too short to be turned into a unit vector is as good as 0.
    if (glm::length(value) < 1e-9) {
        complain("expected a direction, found a vector of length 0");
        return {0.0, 0.0, 1.0};
    }
    return value;
}

} // namespace palpate
