#pragma once

#include <CLI/CLI.hpp>
#include <functional>

#include "engine/base/given_settings.h"
#include "engine/program/option_checks.h"

// Options of the command line out of a table of settings.
namespace palpate {

// The settings from the first of `rest` on that are values of one option.
template <class Struct>
std::span<const Setting<Struct>> of_one_option(std::span<const Setting<Struct>> rest) {
    size_t count = 1;
    while (count < rest.size() &&
           std::string_view(rest[count].use.option) == rest.front().use.option)
        ++count;
    return rest.first(count);
}

// Tells people who takes a bit of SettingUse::of.
using ReadersText = std::string (*)(uint32_t of);

// `take` gets what is given, with a row of the table; `usual` has the defaults, for the help.
// `readers` is for tables that say who reads a setting. The table lives as long as `app`.
template <class Struct>
void add_settings(CLI::App& app, const Struct& usual, std::span<const Setting<Struct>> settings,
                  ReadersText readers,
                  std::function<void(const Setting<Struct>&, double value)> take) {
    while (!settings.empty()) {
        const auto rows = of_one_option(settings);
        settings = settings.subspan(rows.size());
        const Setting<Struct>& first = rows.front();
        if (!*first.use.option)
            continue;
        std::string help, remarks = first.unit;
        for (const Setting<Struct>& row : rows)
            help += fmt::format("{}{}", help.empty() ? "" : "; after a comma: ", row.help);
        if (const uint32_t of = rows.back().use.of)
            remarks += fmt::format("{}of {}", remarks.empty() ? "" : "; ", readers(of));
        if (*first.use.by_default)
            remarks +=
                fmt::format("{}default: {}", remarks.empty() ? "" : "; ", first.use.by_default);
        if (!remarks.empty())
            help += fmt::format(" ({})", remarks);
        CLI::Option* option = app.add_option(
            fmt::format("--{}", first.use.option),
            [take, rows](const CLI::results_t& words) {
                for (size_t i = 0; i < rows.size(); ++i) {
                    double value = 0.0;
                    CLI::detail::lexical_cast(words[std::min(i, words.size() - 1)], value);
                    take(rows[i], value);
                }
                return true;
            },
            help);
        option->type_name(is_whole(first) ? "UINT" : "FLOAT")
            ->expected(1, static_cast<int>(rows.size()))
            ->check(
                number_where(range_text(first), [&first](double v) { return allows(first, v); }));
        if (rows.size() > 1)
            option->delimiter(',');
        if (!*first.use.by_default)
            option->default_str(fmt::format("{}", value_of(first, usual)));
    }
}

// `to` holds the defaults and gets what is given. It lives as long as `app`.
template <class Struct>
void add_settings(CLI::App& app, Struct& to, std::span<const Setting<Struct>> settings,
                  ReadersText readers = nullptr) {
    add_settings<Struct>(
        app, to, settings, readers,
        [&to](const Setting<Struct>& setting, double value) { set(setting, to, value); });
}

// The same for a struct that is known later.
template <class Struct>
void add_settings(CLI::App& app, GivenSettings<Struct>& to,
                  std::span<const Setting<Struct>> settings) {
    add_settings<Struct>(
        app, Struct{}, settings, nullptr,
        [&to](const Setting<Struct>& setting, double value) { to.give(setting, value); });
}

// Copies the settings whose options were given.
template <class Struct>
void take_given(const CLI::App& app, const Struct& from, Struct& to,
                std::span<const Setting<Struct>> settings) {
    for (const Setting<Struct>& setting : settings)
        if (*setting.use.option && app.count(fmt::format("--{}", setting.use.option)) > 0)
            set(setting, to, value_of(setting, from));
}

// The options that a reader who takes these bits has no use for; 0: it reads nothing, and
// `why_none` tells why.
template <class Struct>
std::vector<IdleOptions> idle_settings(std::span<const Setting<Struct>> settings, uint32_t takes,
                                       ReadersText readers, const char* why_none) {
    std::vector<IdleOptions> idle;
    while (!settings.empty()) {
        const auto rows = of_one_option(settings);
        settings = settings.subspan(rows.size());
        const bool is_read = std::any_of(rows.begin(), rows.end(),
                                         [&](const auto& row) { return is_read_by(row, takes); });
        if (*rows.front().use.option && (takes == 0 || !is_read))
            idle.push_back(
                {true,
                 {fmt::format("--{}", rows.front().use.option)},
                 takes == 0 ? why_none : fmt::format("of {}", readers(rows.back().use.of))});
    }
    return idle;
}

} // namespace palpate
