#include "engine/decode/file_list.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "engine/io/decoder.h"
#include "engine/io/text_header.h"

namespace palpate::io {

namespace fs = std::filesystem;

namespace {

constexpr int64_t kMostListedFiles = 65536;

// Whether a pattern holds exactly one "%d" or "%0Nd", N of one or two digits, and no other "%".
bool is_number_pattern(std::string_view pattern) {
    const size_t percent = pattern.find('%');
    if (percent == std::string_view::npos)
        return false;
    size_t at = percent + 1;
    while (at < pattern.size() && at <= percent + 3 && pattern[at] >= '0' && pattern[at] <= '9')
        ++at;
    return at < pattern.size() && pattern[at] == 'd' && pattern.find('%', at) == pattern.npos;
}

} // namespace

std::optional<FilePattern> file_pattern(std::string_view text, size_t most_numbers) {
    FilePattern found;
    text = trimmed(text);
    while (found.numbers.size() < most_numbers) {
        const size_t space = text.find_last_of(" \t");
        const std::string_view word = space == text.npos ? text : text.substr(space + 1);
        const std::optional<int64_t> number = parse_integer(word);
        if (!number || space == text.npos)
            break;
        found.numbers.insert(found.numbers.begin(), *number);
        text = trimmed(text.substr(0, space));
    }
    if (!is_number_pattern(text))
        return {};
    found.pattern = text;
    return found;
}

Result<std::vector<std::string>> names_of(const fs::path& header, const std::string& pattern,
                                          int64_t first, int64_t last, int64_t step) {
    const auto is_int = [](int64_t n) { return n >= -INT32_MAX && n <= INT32_MAX; };
    if (step == 0 || !is_int(first) || !is_int(last) || !is_int(step) ||
        (last > first && step < 0) || (last < first && step > 0) ||
        (last - first) / step >= kMostListedFiles)
        return fail("{}: expected a range of 1 .. {} files, found \"{} {} {} {}\"", header.string(),
                    kMostListedFiles, pattern, first, last, step);
    std::vector<std::string> names;
    for (int64_t i = first; step > 0 ? i <= last : i >= last; i += step) {
        std::array<char, 512> name;
        const int length =
            std::snprintf(name.data(), name.size(), pattern.c_str(), static_cast<int>(i));
        if (length < 0 || static_cast<size_t>(length) >= name.size())
            return fail("{}: expected shorter names of data files, found \"{}\"", header.string(),
                        pattern.substr(0, 60));
        names.emplace_back(name.data());
    }
    return names;
}

Result<std::vector<fs::path>> files_of(const fs::path& header,
                                       const std::vector<std::string>& names) {
    if (names.empty())
        return fail("{}: expected the names of its data files, a list of them, found none",
                    header.string());
    if (names.size() > static_cast<size_t>(kMostListedFiles))
        return fail("{}: expected a list of at most {} data files, found {}", header.string(),
                    kMostListedFiles, names.size());
    std::vector<fs::path> files;
    files.reserve(names.size());
    for (const std::string& name : names) {
        PALPATE_TRY(fs::path beside, file_beside(header, name));
        files.push_back(std::move(beside));
    }
    return files;
}

uint64_t files_for(const std::vector<int64_t>& sizes, size_t dimensions) {
    constexpr uint64_t most = uint64_t{1} << 31;
    uint64_t files = 1;
    for (size_t i = dimensions; i < sizes.size() && files < most; ++i)
        files *= static_cast<uint64_t>(sizes[i]); // each is below 2^31
    return std::min(files, most);
}

bool is_list_mark(std::string_view field) {
    const std::vector<std::string_view> words = words_of(field);
    return !words.empty() && words[0] == "LIST";
}

std::vector<std::string> names_in(std::string_view text) {
    std::vector<std::string> names;
    while (!text.empty()) {
        std::optional<std::string_view> line = take_line(text);
        if (!line) // the last may lack its line end
            line = std::exchange(text, {});
        const std::string_view name = trimmed(*line);
        if (name.empty())
            break;
        names.emplace_back(name);
    }
    return names;
}

} // namespace palpate::io
