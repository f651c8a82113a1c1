#pragma once

#include <CLI/CLI.hpp>
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

// Lets no option of `app` or its sub-commands that holds a floating-point number take one that is
// not finite.
void refuse_not_finite(CLI::App& app);

// One of the names of a table, in help and errors as they are typed.
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

// Options of a command that change nothing together with others: one warning names those of them
// that were given, and why: "--slab (without --slice)".
struct IdleOptions {
    bool are_idle = false;
    std::vector<const char*> options{};
    const char* why = "";
};
void warn_of_idle(const CLI::App& app, std::span<const IdleOptions> all);

enum class FileUse { read, write };

// A file and the option that names it.
struct NamedFile {
    std::string option;
    std::string path; // "" and "-" name no file
    FileUse use = FileUse::read;
    bool makes_folder = false; // its folder is made before it is written
};

// A volume, and the .raw beside a .mhd that is written, or beside a .mhd or .nhdr that is read,
// where there is one.
void append_volume(std::vector<NamedFile>& files, const std::string& option,
                   const std::string& path, FileUse use = FileUse::read);

// Whether two names lead to one place on disk, be it there or not.
bool is_same_file(const std::string& a, const std::string& b);

// An error where a file that is written is named twice.
Result<void> each_its_own(std::span<const NamedFile> files);

// An error where a file cannot be written: before the work, not after an hour of it.
Result<void> all_can_be_written(std::span<const NamedFile> files);

} // namespace palpate
