#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "engine/base/error.h"

namespace palpate {

// The text of a report: JSON of two spaces a level with a final line break. Bytes that are no UTF-8
// become U+FFFD, and control characters are escaped, so that a terminal can show it.
std::string report_text(const nlohmann::ordered_json& report);

// Prints text for people on standard output, control characters escaped but for line breaks
// (engine/base/printable.h). An error when it cannot be written.
Result<void> print_text(std::string_view text);

// The same for the text of a report, which stays valid JSON.
Result<void> print_report(std::string_view json);

// Text for programs to a file, or to standard output where the path is "-"; nothing where it is "".
Result<void> write_text(const std::string& path, const std::string& text);

} // namespace palpate
