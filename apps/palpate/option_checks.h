#pragma once

#include <CLI/CLI.hpp>
#include <initializer_list>
#include <string>

#include "engine/base/error.h"

namespace palpate {

// Checks of option values, in words that name what is expected and what was found. Not a number and
// infinity are neither.
CLI::Validator positive();     // above 0
CLI::Validator non_negative(); // 0 or above

// Lets no option of `app` or its sub-commands that holds a floating-point number take one that is
// not finite.
void refuse_not_finite(CLI::App& app);

// A file and the option that names it.
struct NamedFile {
    const char* option;
    const std::string& path; // "" and "-" name no file
};

// An error where two of the options name one file.
Result<void> each_its_own(std::initializer_list<NamedFile> files);

} // namespace palpate
