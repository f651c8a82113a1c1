#include "engine/program/option_checks.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/base/log.h"
#include "engine/base/option_name.h"
#include "haptics/device/registry.h"

namespace palpate {

namespace {

std::optional<double> finite(const std::string& text) {
    double value = 0;
    if (!CLI::detail::lexical_cast(text, value) || !std::isfinite(value))
        return {};
    return value;
}

} // namespace

CLI::Validator number_where(const std::string& expected, std::function<bool(double)> holds) {
    return CLI::Validator(
        [expected, holds = std::move(holds)](const std::string& text) {
            const std::optional<double> value = finite(text);
            return value && holds(*value) ? std::string()
                                          : fmt::format("expected {}, found '{}'", expected, text);
        },
        "");
}

CLI::Validator positive() {
    return number_where("a number above 0", [](double v) { return v > 0.0; });
}

CLI::Validator non_negative() {
    return number_where("a number of 0 or above", [](double v) { return v >= 0.0; });
}

CLI::Validator within(double least, double most) {
    return number_where(fmt::format("a number from {:g} to {:g}", least, most),
                        [least, most](double v) { return v >= least && v <= most; });
}

CLI::Validator one_of(const std::vector<std::string>& names) {
    return CLI::Validator(
        [names](const std::string& text) {
            return std::find(names.begin(), names.end(), text) != names.end()
                       ? std::string()
                       : fmt::format("expected one of {}, found '{}'", fmt::join(names, ", "),
                                     text);
        },
        "");
}

CLI::Validator device_name() {
    return CLI::Validator(
        [](const std::string& text) {
            const Result<haptics::DeviceEntry> found = haptics::find_device(text);
            return found ? std::string() : found.error().message;
        },
        "");
}

void refuse_not_finite(CLI::App& app) {
    const CLI::Validator any = number_where("a finite number", [](double) { return true; });
    for (CLI::Option* option : app.get_options())
        if (option->get_type_name().starts_with("FLOAT"))
            option->check(any);
    for (CLI::App* sub : app.get_subcommands({}))
        refuse_not_finite(*sub);
}

void refuse_where_wrong(CLI::App& app, std::function<Result<void>()> check) {
    app.final_callback([check = std::move(check)] {
        if (const Result<void> right = check(); !right)
            throw CLI::ValidationError(right.error().message);
    });
}

void warn_of_idle(const CLI::App& app, std::span<const IdleOptions> all) {
    std::string idle;
    for (const IdleOptions& some : all)
        for (const std::string& name : some.options)
            if (const CLI::Option* option = app.get_option_no_throw(name);
                option && some.are_idle && option->count() > 0)
                idle +=
                    fmt::format("{}{} ({})", idle.empty() ? "" : ", ", option_of(name), some.why);
    if (!idle.empty())
        log::warning("without effect here: {}", idle);
}

} // namespace palpate
