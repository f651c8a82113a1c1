#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>

#include "engine/segment/filters.h"

namespace palpate {

namespace {

std::vector<std::string> split(const std::string& text, char separator) {
    std::vector<std::string> parts{""};
    for (const char c : text)
        if (c == separator)
            parts.emplace_back();
        else
            parts.back() += c;
    return parts;
}

std::string upper(const char* name) {
    std::string text = name;
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return char(c == '-' ? '_' : std::toupper(c)); });
    return text;
}

std::string range_text(const FilterParameter& p) {
    if (p.words[0] != '\0') {
        std::string text = p.words;
        std::replace(text.begin(), text.end(), '|', '/');
        return text;
    }
    return fmt::format("{:g} .. {:g}{}{}", p.least, p.most, p.unit[0] == '\0' ? "" : " ", p.unit);
}

} // namespace

Result<double> read_filter_value(const FilterParameter& p, const std::string& text) {
    if (p.words[0] != '\0') {
        const std::vector<std::string> words = split(p.words, '|');
        const auto found = std::find(words.begin(), words.end(), text);
        if (found == words.end())
            return fail("{}: expected {}, found '{}'", p.name, range_text(p), text);
        return double(found - words.begin());
    }
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (text.empty() || *end != '\0' || !(value >= p.least && value <= p.most) ||
        (p.whole && value != std::floor(value)))
        return fail("{}: expected a {}number {}, found '{}'", p.name, p.whole ? "whole " : "",
                    range_text(p), text);
    return value;
}

Result<FilterValues> read_filter_values(const Filter& filter, const std::string& text) {
    FilterValues values;
    if (filter.text[0] != '\0') {
        values.text = text;
        return values;
    }
    const std::vector<FilterParameter>& all = filter.parameters;
    std::vector<std::optional<double>> read(all.size());
    size_t next = 0;
    for (const std::string& part : text.empty() ? std::vector<std::string>() : split(text, ',')) {
        const size_t equals = part.find('=');
        size_t at = next++;
        if (equals != std::string::npos) {
            const std::string name = part.substr(0, equals);
            at = size_t(std::find_if(all.begin(), all.end(),
                                     [&](const FilterParameter& p) { return name == p.name; }) -
                        all.begin());
        }
        if (at >= all.size())
            return fail("expected {}, found '{}'", filter_arguments(filter), text);
        if (read[at])
            return fail("{}: expected one value, found '{}'", all[at].name, text);
        PALPATE_TRY(read[at],
                    read_filter_value(
                        all[at], equals == std::string::npos ? part : part.substr(equals + 1)));
    }
    for (size_t i = 0; i < all.size(); ++i) {
        if (!read[i] && !all[i].preset)
            return fail("expected {}, found '{}'", filter_arguments(filter), text);
        values.numbers.push_back(read[i].value_or(all[i].preset.value_or(0.0)));
    }
    return values;
}

Result<Volume> other_volume(const FilterValues& values, const std::string& name) {
    if (values.others)
        if (const auto found = values.others->find(name); found != values.others->end())
            return found->second;
    return fail("expected the name of a volume that --with {}=FILE gives, found '{}'", "NAME",
                name);
}

Result<std::vector<uint16_t>> read_locked_labels(const std::string& text) {
    std::vector<uint16_t> labels;
    for (const std::string& part : split(text, ',')) {
        PALPATE_TRY(const double label,
                    read_filter_value({"label", "", 1, 65535, {}, "", true}, part));
        labels.push_back(uint16_t(label));
    }
    return labels;
}

std::string filter_arguments(const Filter& filter) {
    if (filter.text[0] != '\0')
        return filter.text;
    std::string text, closing;
    for (const FilterParameter& p : filter.parameters) {
        const bool optional = p.preset.has_value();
        text += fmt::format("{}{}{}", optional ? "[" : "", text.empty() ? "" : ",", upper(p.name));
        closing += optional ? "]" : "";
    }
    return text + closing;
}

std::string filter_ranges(const Filter& filter) {
    std::string text;
    for (const FilterParameter& p : filter.parameters) {
        text += fmt::format("{}{}: {}", text.empty() ? "" : "; ", p.name, range_text(p));
        if (!p.preset)
            continue;
        text += p.words[0] != '\0'
                    ? fmt::format(" (default: {})", split(p.words, '|')[size_t(*p.preset)])
                    : fmt::format(" (default: {:g})", *p.preset);
    }
    return text;
}

} // namespace palpate
