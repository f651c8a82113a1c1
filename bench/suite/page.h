#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "bench/suite/environment.h"
#include "engine/base/error.h"

namespace palpate::bench {

// Writes FOLDER/index.html: one file that needs nothing else, from every suite's result (NAME.json)
// in the folder. Pictures they name are put inside.
Result<void> write_page(const std::filesystem::path& folder);

// One file that needs nothing else: what `script` draws of `results`, with the functions of
// page.html.
std::string page_of(std::string_view script, const Json& results);

// The page of the suites for results at hand, pictures already inside as data addresses.
std::string page_html(const Json& results);

} // namespace palpate::bench
