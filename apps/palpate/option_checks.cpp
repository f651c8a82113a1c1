#include "apps/palpate/option_checks.h"

#include <cmath>
#include <filesystem>
#include <optional>

#include "engine/base/log.h"
#include "engine/base/writable.h"

namespace palpate {

namespace {

std::optional<double> finite(const std::string& text) {
    double value = 0;
    if (!CLI::detail::lexical_cast(text, value) || !std::isfinite(value))
        return {};
    return value;
}

template <class Holds>
CLI::Validator number(const std::string& words, Holds holds) {
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

CLI::Validator within(double least, double most) {
    return number(fmt::format("a number from {:g} to {:g}", least, most),
                  [least, most](double v) { return v >= least && v <= most; });
}

void refuse_not_finite(CLI::App& app) {
    const CLI::Validator any = number("a finite number", [](double) { return true; });
    for (CLI::Option* option : app.get_options())
        if (option->get_type_name().starts_with("FLOAT"))
            option->check(any);
    for (CLI::App* sub : app.get_subcommands({}))
        refuse_not_finite(*sub);
}

void warn_of_idle(const CLI::App& app, std::span<const IdleOptions> all) {
    std::string idle;
    for (const IdleOptions& some : all)
        for (const char* option : some.options)
            if (some.are_idle && app.get_option(option)->count() > 0)
                idle += fmt::format("{}{} ({})", idle.empty() ? "" : ", ", option, some.why);
    if (!idle.empty())
        log::warning("without effect here: {}", idle);
}

void append_volume(std::vector<NamedFile>& files, const std::string& option,
                   const std::string& path, FileUse use) {
    files.push_back({option, path, use});
    std::filesystem::path beside = path;
    const bool has_voxels_beside =
        beside.extension() == ".mhd" || (use == FileUse::read && beside.extension() == ".nhdr");
    beside.replace_extension(".raw");
    std::error_code ignored;
    if (has_voxels_beside && (use == FileUse::write || std::filesystem::exists(beside, ignored)))
        files.push_back({"the voxels of " + option, beside.string(), use});
}

bool is_same_file(const std::string& a, const std::string& b) {
    namespace fs = std::filesystem;
    std::error_code ignored;
    return fs::weakly_canonical(a, ignored) == fs::weakly_canonical(b, ignored) ||
           fs::equivalent(a, b, ignored);
}

Result<void> all_can_be_written(std::span<const NamedFile> files) {
    for (const NamedFile& file : files)
        if (file.use == FileUse::write && !file.makes_folder && !file.path.empty() &&
            file.path != "-")
            if (Result<void> can = expect_writable(file.path); !can)
                return can;
    return {};
}

Result<void> each_its_own(std::span<const NamedFile> files) {
    const auto is_file = [](const NamedFile& file) {
        return !file.path.empty() && file.path != "-" && !file.path.starts_with("synthetic:");
    };
    for (size_t i = 0; i < files.size(); ++i)
        for (size_t j = i + 1; j < files.size(); ++j) {
            const NamedFile &a = files[i], &b = files[j];
            const bool one_is_written = a.use == FileUse::write || b.use == FileUse::write;
            if (one_is_written && is_file(a) && is_file(b) && is_same_file(a.path, b.path))
                return fail("{} and {}: expected a file for each, found '{}' for both", a.option,
                            b.option, a.path);
        }
    return {};
}

} // namespace palpate
