#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"

namespace palpate {

// Checks of option values, in words that name what is expected and what was found. Not a number and
// infinity are neither.
CLI::Validator positive();     // above 0
CLI::Validator non_negative(); // 0 or above
CLI::Validator within(double least, double most);
CLI::Validator number_where(const std::string& expected, std::function<bool(double)> holds);

// Lets no option of `app` or its sub-commands that holds a floating-point number take one that is
// not finite.
void refuse_not_finite(CLI::App& app);

// Has the command line refused, as wrong usage, where `check` fails once all options of `app` are
// read: for what one option's value alone does not show. One a command.
void refuse_where_wrong(CLI::App& app, std::function<Result<void>()> check);

// One of some names, in help and errors as they are typed.
CLI::Validator one_of(const std::vector<std::string>& names);

// The same of a table, for an option that holds its values.
template <class Value>
CLI::Validator one_of(const std::map<std::string, Value>& table) {
    std::string names;
    for (const auto& [name, value] : table)
        names += (names.empty() ? "" : ",") + name;
    return CLI::Validator(
        [table, names](std::string& text) {
            const auto found = table.find(text);
            if (found == table.end())
                return fmt::format("expected one of {}, found '{}'", names, text);
            text = std::to_string(static_cast<int>(found->second));
            return std::string();
        },
        "{" + names + "}");
}

// Refuses texts that `read`, a function such as those of option_texts.h, does not read: wrong
// usage.
template <class Read>
CLI::Validator readable(Read read) {
    return CLI::Validator(
        [read](const std::string& text) {
            const auto value = read(text);
            return value ? std::string() : value.error().message;
        },
        "");
}

// A haptic device as haptics::find_device() takes it.
CLI::Validator device_name();

// Options of a command that change nothing together with others: one warning names those of them
// that were given, and why: "--slab (without --slice)". Python has some of them alone.
struct IdleOptions {
    bool are_idle = false;
    std::vector<std::string> options{};
    std::string why{};
};
void warn_of_idle(const CLI::App& app, std::span<const IdleOptions> all);

} // namespace palpate
