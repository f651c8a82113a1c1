#pragma once

#include <optional>
#include <string_view>

namespace palpate::io {

// Millimetres in a unit of length as files name it: a symbol ("um", "nm", "mm", "cm", "m", "in"; a
// micro sign in UTF-8, Latin-1 or as ImageJ escapes it, "\u00B5m") or a word of one or several
// ("micron", "micrometers", "millimetre", "inches"), in upper or lower case. Absent for others.
std::optional<double> length_in_mm(std::string_view unit);

} // namespace palpate::io
