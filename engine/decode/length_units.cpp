#include "engine/decode/length_units.h"

#include <string>

#include "engine/io/text_header.h"

namespace palpate::io {

namespace {

struct Scale {
    std::string_view prefix, symbol;
    double mm; // of this scale times a metre
};
constexpr Scale kScales[] = {{"femto", "f", 1e-12}, {"pico", "p", 1e-9}, {"nano", "n", 1e-6},
                             {"micro", "u", 1e-3},  {"milli", "m", 1},   {"centi", "c", 10},
                             {"deci", "d", 100.0},  {"", "", 1000},      {"deca", "da", 1e4},
                             {"hecto", "h", 1e5},   {"kilo", "k", 1e6}};

struct Name {
    std::string_view name; // in the singular
    double mm;
};
constexpr Name kNames[] = {
    {"micron", 1e-3},
    {"in", 25.4},
    {"inch", 25.4},
    {"inche", 25.4},
    {"\"", 25.4},
    {"angstrom", 1e-7},
    {"\xc3\x85", 1e-7},
    {"\xc3\xa5", 1e-7},
    {"\xe2\x84\xab", 1e-7},
    // The imperial ones of OME: a line is a twelfth of an inch, a point a 72nd.
    {"thou", 0.0254},
    {"mil", 0.0254},
    {"li", 25.4 / 12},
    {"line", 25.4 / 12},
    {"pt", 25.4 / 72},
    {"point", 25.4 / 72},
    {"ft", 304.8},
    {"foot", 304.8},
    {"feet", 304.8},
    {"yd", 914.4},
    {"yard", 914.4},
    {"mi", 1609344},
    {"mile", 1609344}};

// MICRO SIGN (U+00B5) and GREEK SMALL LETTER MU (U+03BC) in UTF-8, the former in Latin-1, and both
// as Java escapes them.
constexpr std::string_view kMicro[] = {"\xc2\xb5", "\xce\xbc", "\xb5", "\\u00b5", "\\u03bc"};

} // namespace

std::optional<double> length_in_mm(std::string_view unit) {
    std::string name = lower_case(trimmed(unit));
    for (const std::string_view micro : kMicro)
        if (name.starts_with(micro)) {
            name.replace(0, micro.size(), "u");
            break;
        }
    if (name.size() > 2 && name.ends_with('s'))
        name.pop_back();
    for (const Scale& scale : kScales)
        for (const std::string_view word : {"meter", "metre"})
            if (name == std::string(scale.prefix) + std::string(word) ||
                name == std::string(scale.symbol) + "m")
                return scale.mm;
    for (const Name& known : kNames)
        if (name == known.name)
            return known.mm;
    return {};
}

} // namespace palpate::io
