#include "engine/base/printable.h"

#include <fmt/format.h>

#include <cstdint>

namespace palpate {

namespace {

struct Character {
    uint32_t code = 0;
    size_t bytes = 0; // 0: the first byte begins no character
};

// The first character of a text that is not empty (RFC 3629: no overlong forms, no surrogates).
Character first_of(std::string_view text) {
    const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
    const unsigned char lead = byte(0);
    if (lead < 0x80)
        return {lead, 1};
    const size_t bytes = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
    if (lead < 0xc2 || lead > 0xf4 || text.size() < bytes)
        return {};
    uint32_t code = lead & (0x7f >> bytes);
    for (size_t i = 1; i < bytes; ++i) {
        if ((byte(i) & 0xc0) != 0x80)
            return {};
        code = code << 6 | (byte(i) & 0x3f);
    }
    constexpr uint32_t least[] = {0, 0, 0x80, 0x800, 0x10000};
    if (code < least[bytes] || code > 0x10ffff || (code >= 0xd800 && code <= 0xdfff))
        return {};
    return {code, bytes};
}

bool is_harmless(uint32_t code) {
    return code >= 0x20 && (code < 0x7f || code > 0x9f) && (code < 0x2028 || code > 0x202e) &&
           (code < 0x2066 || code > 0x2069);
}

// write(out, code) escapes a character, or a byte that is none.
template <class Write>
std::string escaped(std::string_view text, const Write& write) {
    std::string out;
    out.reserve(text.size());
    while (!text.empty()) {
        const Character next = first_of(text);
        if (next.bytes > 0 && is_harmless(next.code))
            out.append(text.substr(0, next.bytes));
        else
            write(out, next.bytes > 0 ? next.code : static_cast<unsigned char>(text[0]));
        text.remove_prefix(next.bytes > 0 ? next.bytes : 1);
    }
    return out;
}

void write_escape(std::string& out, uint32_t code) {
    if (code == '\n')
        out += "\\n";
    else if (code == '\r')
        out += "\\r";
    else if (code == '\t')
        out += "\\t";
    else
        out += code < 0x100 ? fmt::format("\\x{:02x}", code) : fmt::format("\\u{:04x}", code);
}

} // namespace

std::string printable(std::string_view text) {
    return escaped(text, write_escape);
}

std::string printable_lines(std::string_view text) {
    return escaped(text, [](std::string& out, uint32_t code) {
        code == '\n' ? out.push_back('\n') : write_escape(out, code);
    });
}

std::string printable_json(std::string_view json) {
    return escaped(json, [](std::string& out, uint32_t code) {
        if (code < 0x20) // between the values of a document; within strings JSON has none
            out.push_back(static_cast<char>(code));
        else
            out += fmt::format("\\u{:04x}", code);
    });
}

} // namespace palpate
