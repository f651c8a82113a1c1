#pragma once

#include <string>
#include <string_view>

#include "engine/base/error.h"
#include "engine/base/json.h"
#include "engine/volume/volume.h"

namespace palpate {

// json_text() with control characters escaped, so that a terminal can show it. Every report of the
// program is this.
std::string report_text(const Json& report);

// Prints text for people on standard output, control characters escaped but for line breaks
// (engine/base/printable.h). An error when it cannot be written.
Result<void> print_text(std::string_view text);

// The same for the text of a report, which stays valid JSON.
Result<void> print_report(std::string_view json);

// Text for programs to a file, or to standard output where the path is "-"; nothing where it is "".
Result<void> write_text(const std::string& path, const std::string& text);

// One line about a file that was made, for commands that say nothing else: "PATH: WHAT, 1.2 MB". Of
// an .mhd with the size of the .raw beside it. --quiet drops it.
void tell_made(const std::string& path, const std::string& what);
void tell_made(const std::string& path, const Volume& volume); // its size and type

// Warns that `out` does not hold what `from` says: that its small values are meant to be bright.
void warn_of_lost_inversion(const std::string& out, const std::string& from);

} // namespace palpate
