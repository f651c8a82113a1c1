#include "engine/decode/slice_list.h"

#include <fnmatch.h>

#include <algorithm>
#include <cmath>

#include "engine/base/file.h"
#include "engine/base/json_value.h"
#include "engine/decode/picture.h"
#include "engine/io/text_header.h"

namespace palpate::io {

namespace fs = std::filesystem;

namespace {

constexpr double kFarthest = 1e300; // of numbers in a sidecar: all that are finite

bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

// A printf pattern in its parts: "ct_%03d.png" is "ct_", 3 digits at least, ".png".
struct Numbered {
    std::string before, after;
    size_t width = 0;
};

std::optional<Numbered> numbered(const std::string& pattern) {
    const size_t percent = pattern.find('%');
    if (percent == std::string::npos)
        return {};
    size_t at = percent + 1;
    Numbered parts{pattern.substr(0, percent), {}, 0};
    while (at < pattern.size() && is_digit(pattern[at]) && parts.width < 100)
        parts.width = 10 * parts.width + static_cast<size_t>(pattern[at++] - '0');
    if (at >= pattern.size() || (pattern[at] != 'd' && pattern[at] != 'u'))
        return {};
    parts.after = pattern.substr(at + 1);
    return parts;
}

bool matches(const Numbered& parts, const std::string& name) {
    if (name.size() <= parts.before.size() + parts.after.size() ||
        !name.starts_with(parts.before) || !name.ends_with(parts.after))
        return false;
    const std::string number =
        name.substr(parts.before.size(), name.size() - parts.before.size() - parts.after.size());
    return std::all_of(number.begin(), number.end(), is_digit) && number.size() >= parts.width &&
           (number.size() <= std::max<size_t>(parts.width, 1) || number[0] != '0');
}

// The last number in a name.
std::optional<uint64_t> number_in(const std::string& name) {
    size_t end = name.size();
    while (end > 0 && !is_digit(name[end - 1]))
        --end;
    size_t start = end;
    while (start > 0 && is_digit(name[start - 1]))
        --start;
    if (start == end || end - start > 18)
        return {};
    return std::stoull(name.substr(start, end - start));
}

void warn_of_gaps(const fs::path& folder, const std::vector<fs::path>& files,
                  std::vector<std::string>& warnings) {
    std::optional<uint64_t> usual; // the smallest step
    std::vector<uint64_t> numbers;
    for (const fs::path& file : files) {
        const std::optional<uint64_t> number = number_in(file.filename().string());
        if (!number || (!numbers.empty() && *number <= numbers.back()))
            return; // the names do not count
        if (!numbers.empty())
            usual = std::min(usual.value_or(*number - numbers.back()), *number - numbers.back());
        numbers.push_back(*number);
    }
    for (size_t i = 1; i < numbers.size(); ++i)
        if (numbers[i] - numbers[i - 1] != usual) {
            warnings.push_back(fmt::format(
                "{}: slices seem to be missing between {} and {}; they are read as neighbours",
                folder.string(), files[i - 1].filename().string(), files[i].filename().string()));
            return;
        }
}

template <class Keep>
Result<std::vector<fs::path>> sorted_files(const fs::path& folder, const Keep& keep,
                                           std::vector<std::string>& warnings) {
    std::vector<fs::path> files;
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
        if (entry.is_regular_file() && keep(entry.path()))
            files.push_back(entry.path());
    if (error)
        return fail("{}: cannot be read: {}", folder.string(), error.message());
    std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
        return natural_less(a.filename().string(), b.filename().string());
    });
    warn_of_gaps(folder, files, warnings);
    return files;
}

SliceSidecar read_sidecar(const JsonValue& in) {
    SliceSidecar out;
    in.only_keys({"pattern", "spacing_mm", "origin_mm", "directions", "size", "type", "endianness",
                  "header_bytes", "modality"});
    if (const auto pattern = in.find("pattern")) {
        out.pattern = pattern->text();
        if (out.pattern->find('/') != std::string::npos)
            pattern->reject("names without a folder");
    }
    if (const auto spacing = in.find("spacing_mm")) {
        out.spacing_mm = spacing->vector(-kFarthest, kFarthest);
        if (!glm::all(glm::greaterThan(*out.spacing_mm, glm::dvec3(0.0))))
            spacing->complain("expected positive numbers");
    }
    if (const auto origin = in.find("origin_mm"))
        out.origin_mm = origin->vector(-kFarthest, kFarthest);
    if (const auto directions = in.find("directions")) {
        int axis = 0;
        for (const JsonValue& direction : directions->items(3, 3)) {
            out.directions[axis] = direction.vector(-2.0, 2.0);
            if (std::abs(glm::length(out.directions[axis++]) - 1.0) > 1e-3)
                direction.complain("expected a unit vector");
        }
    }
    if (const auto size = in.find("size"))
        if (const auto sides = size->items(2, 2); sides.size() == 2)
            out.size = {sides[0].whole_number(0, ~0u), sides[1].whole_number(0, ~0u)};
    using enum ComponentType;
    if (const auto type = in.find("type"))
        out.type = type->choice<ComponentType>({{"u8", u8},
                                                {"i8", i8},
                                                {"u16", u16},
                                                {"i16", i16},
                                                {"u32", u32},
                                                {"i32", i32},
                                                {"u64", u64},
                                                {"i64", i64},
                                                {"f32", f32},
                                                {"f64", f64}});
    if (const auto order = in.find("endianness"))
        out.big_endian = order->choice<bool>({{"little", false}, {"big", true}});
    if (const auto header = in.find("header_bytes"))
        out.header_bytes = header->whole_number(0, ~0u);
    in.take("modality", out.modality);
    return out;
}

} // namespace

Result<SliceSidecar> load_sidecar(const fs::path& path) {
    PALPATE_TRY(const std::string text, load_text(path, 1 << 20));
    PALPATE_TRY(const Json json, parse_json(text, path.string()));
    JsonErrors errors{path.string(), {}};
    SliceSidecar sidecar = read_sidecar(JsonValue(json, "", errors));
    if (errors.first)
        return tl::unexpected(*errors.first);
    return sidecar;
}

bool is_pattern(const std::string& name) {
    return name.find_first_of("*?") != std::string::npos || numbered(name);
}

Result<std::vector<fs::path>> files_matching(const fs::path& folder, const std::string& pattern,
                                             std::vector<std::string>& warnings) {
    const std::optional<Numbered> parts = numbered(pattern);
    Result<std::vector<fs::path>> files = sorted_files(
        folder,
        [&](const fs::path& path) {
            const std::string name = path.filename().string();
            return parts ? matches(*parts, name)
                         : ::fnmatch(pattern.c_str(), name.c_str(), FNM_PERIOD) == 0;
        },
        warnings);
    if (files && files->empty())
        return fail("{}: no file matches", (folder / pattern).string());
    return files;
}

Result<std::vector<fs::path>> pictures_of(const fs::path& folder,
                                          std::vector<std::string>& warnings) {
    const auto wanted = [](const fs::path& path) {
        return is_picture(lower_case(path.extension().string()));
    };
    PALPATE_TRY(std::vector<fs::path> files, sorted_files(folder, wanted, warnings));
    if (files.empty())
        return fail("{}: holds no pictures (PNG, TIFF, JPEG, BMP)", folder.string());
    for (const fs::path& file : files)
        if (lower_case(file.extension().string()) != lower_case(files.front().extension().string()))
            return fail("{}: holds pictures of several kinds ({}, {}); a pattern chooses",
                        folder.string(), files.front().filename().string(),
                        file.filename().string());
    return files;
}

bool natural_less(const std::string& a, const std::string& b) {
    size_t i = 0, j = 0;
    while (i < a.size() && j < b.size()) {
        if (is_digit(a[i]) && is_digit(b[j])) {
            const auto run = [](const std::string& s, size_t& at) {
                while (at < s.size() && s[at] == '0')
                    ++at;
                const size_t start = at;
                while (at < s.size() && is_digit(s[at]))
                    ++at;
                return s.substr(start, at - start);
            };
            const std::string x = run(a, i), y = run(b, j);
            if (x.size() != y.size())
                return x.size() < y.size();
            if (x != y)
                return x < y;
        } else {
            if (a[i] != b[j])
                return a[i] < b[j];
            ++i;
            ++j;
        }
    }
    if (a.size() - i != b.size() - j)
        return a.size() - i < b.size() - j;
    return a < b; // numbers equal but for leading zeros
}

} // namespace palpate::io
