#include "apps/palpate/option_checks.h"

#include <cmath>
#include <filesystem>
#include <optional>

namespace palpate {

namespace {

std::optional<double> finite(const std::string& text) {
    double value = 0;
    if (!CLI::detail::lexical_cast(text, value) || !std::isfinite(value))
        return {};
    return value;
}

template <class Holds>
CLI::Validator number(const char* words, Holds holds) {
    return CLI::Validator(
        [words, holds](const std::string& text) {
            const std::optional<double> value = finite(text);
            return value && holds(*value) ? std::string()
                                          : fmt::format("expected {}, found '{}'", words, text);
        },
        "");
}

} // namespace

CLI::Validator positive() {
    return number("a number above 0", [](double v) { return v > 0.0; });
}

CLI::Validator non_negative() {
    return number("a number of 0 or above", [](double v) { return v >= 0.0; });
}

void refuse_not_finite(CLI::App& app) {
    const CLI::Validator any = number("a finite number", [](double) { return true; });
    for (CLI::Option* option : app.get_options())
        if (option->get_type_name().starts_with("FLOAT"))
            option->check(any);
    for (CLI::App* sub : app.get_subcommands({}))
        refuse_not_finite(*sub);
}

Result<void> each_its_own(std::initializer_list<NamedFile> files) {
    const auto place = [](const NamedFile& file) {
        std::error_code ignored;
        return std::filesystem::weakly_canonical(file.path, ignored);
    };
    for (auto one = files.begin(); one != files.end(); ++one)
        for (auto other = one + 1; other != files.end(); ++other) {
            const bool named = !one->path.empty() && one->path != "-" && !other->path.empty() &&
                               other->path != "-";
            if (named && place(*one) == place(*other))
                return fail("{} and {}: expected a file for each, found '{}' for both", one->option,
                            other->option, one->path);
        }
    return {};
}

} // namespace palpate
