#include "engine/decode/dicom_text.h"

#include <iconv.h>

#include <algorithm>
#include <string_view>

namespace palpate::io {

namespace {

struct Encoding {
    const char* term; // after ISO_IR or "ISO 2022 IR", or whole
    const char* name; // as iconv knows it
};
constexpr Encoding kEncodings[] = {
    {"100", "ISO-8859-1"}, {"101", "ISO-8859-2"},    {"109", "ISO-8859-3"}, {"110", "ISO-8859-4"},
    {"144", "ISO-8859-5"}, {"127", "ISO-8859-6"},    {"126", "ISO-8859-7"}, {"138", "ISO-8859-8"},
    {"148", "ISO-8859-9"}, {"203", "ISO-8859-15"},   {"166", "TIS-620"},    {"13", "SHIFT_JIS"},
    {"87", "ISO-2022-JP"}, {"159", "ISO-2022-JP-1"}, {"149", "EUC-KR"},     {"58", "EUC-CN"},
    {"192", "UTF-8"},      {"GB18030", "GB18030"},   {"GBK", "GBK"},
};

// The last set that is not the default one: the others are single-byte sets beside it.
const char* encoding_of(const std::vector<std::string>& sets) {
    for (auto set = sets.rbegin(); set != sets.rend(); ++set) {
        const std::string term = set->substr(set->find_last_of(" _") + 1);
        for (const Encoding& encoding : kEncodings)
            if (term == encoding.term)
                return encoding.name;
    }
    return "ASCII";
}

bool is_ascii(std::string_view text) {
    return std::all_of(text.begin(), text.end(),
                       [](char c) { return static_cast<unsigned char>(c) < 0x80 && c != '\x1b'; });
}

// The sets of Korea and China name themselves by an escape sequence, and are then in the upper
// half.
std::string without_escapes(std::string text) {
    for (const std::string_view escape : {"\x1b$)C", "\x1b$)A"})
        for (size_t at; (at = text.find(escape)) != std::string::npos;)
            text.erase(at, escape.size());
    return text;
}

} // namespace

std::string utf8_of(const std::string& bytes, const std::vector<std::string>& sets) {
    if (is_ascii(bytes))
        return bytes;
    const std::string_view encoding = encoding_of(sets);
    std::string from = encoding.starts_with("EUC") ? without_escapes(bytes) : bytes;
    const iconv_t converter = ::iconv_open("UTF-8", encoding.data());
    std::string out;
    char* in = from.data();
    size_t left = from.size();
    while (left > 0) {
        char buffer[256];
        char* to = buffer;
        size_t room = sizeof buffer;
        const bool failed = converter == reinterpret_cast<iconv_t>(-1) ||
                            ::iconv(converter, &in, &left, &to, &room) == static_cast<size_t>(-1);
        out.append(buffer, to);
        if (failed && to == buffer) { // a byte that is no text
            out += '?';
            ++in;
            --left;
        }
    }
    if (converter != reinterpret_cast<iconv_t>(-1))
        ::iconv_close(converter);
    return out;
}

} // namespace palpate::io
