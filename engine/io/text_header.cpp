#include "engine/io/text_header.h"

#include <cctype>
#include <charconv>
#include <span>

#include "engine/io/byte_source.h"

namespace palpate::io {

namespace {

constexpr std::string_view kWhite{" \t\r\n\v\f"};

template <class T>
std::optional<T> parse_number(std::string_view text) {
    text = trimmed(text);
    if (text.size() > 1 && text.front() == '+')
        text.remove_prefix(1);
    T value{};
    const char* const end = text.data() + text.size();
    const auto [stop, problem] = std::from_chars(text.data(), end, value);
    if (problem != std::errc{} || stop != end)
        return {};
    return value;
}

template <class T>
std::optional<std::vector<T>> parse_numbers(std::string_view text) {
    std::vector<T> values;
    for (const std::string_view word : words_of(text)) {
        const std::optional<T> value = parse_number<T>(word);
        if (!value)
            return {};
        values.push_back(*value);
    }
    return values;
}

} // namespace

Result<std::string> load_beginning(const std::string& path) {
    PALPATE_TRY(ByteSource source, ByteSource::open(path, Packing::none));
    std::string text(kMostHeaderBytes, '\0');
    PALPATE_TRY(const size_t got, source.read(std::as_writable_bytes(std::span(text))));
    text.resize(got);
    return text;
}

std::optional<std::string_view> take_line(std::string_view& text) {
    const size_t end = text.find('\n');
    if (end == std::string_view::npos)
        return {};
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end + 1);
    if (line.ends_with('\r'))
        line.remove_suffix(1);
    return line;
}

std::string_view trimmed(std::string_view text) {
    const size_t start = text.find_first_not_of(kWhite);
    if (start == std::string_view::npos)
        return {};
    return text.substr(start, text.find_last_not_of(kWhite) - start + 1);
}

std::string lower_case(std::string_view text) {
    std::string lower(text);
    for (char& c : lower)
        c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return lower;
}

std::vector<std::string_view> words_of(std::string_view text) {
    std::vector<std::string_view> words;
    for (text = trimmed(text); !text.empty(); text = trimmed(text)) {
        const std::string_view word = text.substr(0, text.find_first_of(kWhite));
        words.push_back(word);
        text.remove_prefix(word.size());
    }
    return words;
}

std::optional<double> parse_double(std::string_view text) {
    return parse_number<double>(text);
}
std::optional<int64_t> parse_integer(std::string_view text) {
    return parse_number<int64_t>(text);
}
std::optional<std::vector<double>> parse_doubles(std::string_view text) {
    return parse_numbers<double>(text);
}
std::optional<std::vector<int64_t>> parse_integers(std::string_view text) {
    return parse_numbers<int64_t>(text);
}

} // namespace palpate::io
