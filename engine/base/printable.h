#pragma once

#include <string>
#include <string_view>

namespace palpate {

// Text for a terminal. Names and headers of files may hold escape sequences, which would move the
// cursor, hide text or rename the window; here they are escaped.
//
// Control characters (C0, DEL, and C1, which are U+0080 .. U+009F), characters that turn the
// direction of writing (U+202A .. U+202E, U+2066 .. U+2069) or end a line (U+2028, U+2029), and
// bytes that are no UTF-8 become \x1b, \u202e or \n: each byte or character that is shown so is
// plain ASCII afterwards. Other UTF-8 stays. A backslash stays, so that paths can be copied.

// For a single line: line breaks and tabs are escaped, too.
std::string printable(std::string_view text);

// For several lines: line breaks stay.
std::string printable_lines(std::string_view text);

// For a JSON document: such characters as its strings may hold unescaped become \u007f and the
// like, so that the document says the same as before.
std::string printable_json(std::string_view json);

} // namespace palpate
