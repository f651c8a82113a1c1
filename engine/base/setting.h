#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "engine/base/json_value.h"

// Settings that are described once. A struct of settings has one constexpr table beside it, a row
// for each number; files, the command line, Python, checks, the servo's slew, the window and the
// reference page are made from the table (docs/recipes/setting.md).
namespace palpate {

// How a running servo goes to a new value.
enum class Slew : uint8_t {
    none,     // at once
    straight, // in equal steps
    inverse,  // in equal steps of 1 / value where one end is 0, which stands for infinity
};

// The slider of the window; none without a label. It goes from 0.
struct Slider {
    const char* label = nullptr;
    double most = 1.0;
    int decimals = 2;
};

// The places beside files in which a setting appears.
struct SettingUse {
    // --option of the command line; empty: none. Neighbours in a table with the same one are its
    // values, apart by commas; a missing one is as the one before.
    const char* option = "";
    const char* keyword = "";    // of Python; empty: the option's name
    const char* by_default = ""; // in words where the data decide; empty: the struct's value
    uint32_t of = 0;             // a bit, set for the readers that take it; 0: all do
    Slew slew = Slew::none;
    Slider slider{};
};

template <class Struct>
struct Setting {
    const char* key; // of files: the member's name, which ends with the unit
    std::variant<double Struct::*, uint32_t Struct::*> member;
    double least, most; // both allowed
    const char* unit;   // as people write it; empty: none
    const char* help;   // one sentence without a full stop
    SettingUse use{};
};

template <class Struct>
double value_of(const Setting<Struct>& setting, const Struct& in) {
    return std::visit([&](auto member) { return static_cast<double>(in.*member); }, setting.member);
}
template <class Struct>
bool is_whole(const Setting<Struct>& setting) {
    return std::holds_alternative<uint32_t Struct::*>(setting.member);
}
template <class Struct>
bool allows(const Setting<Struct>& setting, double value) {
    return value >= setting.least && value <= setting.most &&
           (!is_whole(setting) || value == std::floor(value));
}
// Sets a value that the setting allows.
template <class Struct>
void set(const Setting<Struct>& setting, Struct& in, double value) {
    std::visit(
        [&](auto member) {
            in.*member = static_cast<std::remove_reference_t<decltype(in.*member)>>(value);
        },
        setting.member);
}

// "a number from 0 to 100 N/m": what every message expects.
template <class Struct>
std::string range_text(const Setting<Struct>& setting) {
    return fmt::format("a {}number from {} to {}{}{}", is_whole(setting) ? "whole " : "",
                       setting.least, setting.most, *setting.unit ? " " : "", setting.unit);
}

// `takes` are the bits of a reader.
template <class Struct>
bool is_read_by(const Setting<Struct>& setting, uint32_t takes) {
    return setting.use.of == 0 || (takes & setting.use.of) != 0;
}

template <class Struct>
std::vector<std::string_view> keys_of(std::span<const Setting<Struct>> settings,
                                      std::initializer_list<std::string_view> more = {}) {
    std::vector<std::string_view> keys;
    for (const Setting<Struct>& setting : settings)
        keys.emplace_back(setting.key);
    keys.insert(keys.end(), more);
    return keys;
}
template <class Struct>
Json settings_json(const Struct& in, std::span<const Setting<Struct>> settings) {
    Json out = Json::object();
    for (const Setting<Struct>& setting : settings)
        out[setting.key] = value_of(setting, in);
    return out;
}
// Reads the members that there are; the others of `out` stay.
template <class Struct>
void read_settings(const JsonValue& in, Struct& out, std::span<const Setting<Struct>> settings) {
    for (const Setting<Struct>& setting : settings)
        if (const auto value = in.find(setting.key)) {
            if (value->is(Json::Kind::number) && allows(setting, value->json().number))
                set(setting, out, value->json().number);
            else
                value->reject(range_text(setting));
        }
}

} // namespace palpate
