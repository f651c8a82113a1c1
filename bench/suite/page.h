#pragma once

#include <filesystem>
#include <string>

#include "bench/suite/environment.h"
#include "engine/base/error.h"

namespace palpate::bench {

// Writes FOLDER/index.html: one file that needs nothing else, from every suite's result (NAME.json)
// in the folder. Pictures they name are put inside.
Result<void> write_page(const std::filesystem::path& folder);

// The page of the suites for results at hand, pictures already inside as data addresses.
std::string page_html(const Json& results);

} // namespace palpate::bench
