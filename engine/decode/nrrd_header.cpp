#include "engine/decode/nrrd_header.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "engine/decode/file_list.h"
#include "engine/decode/length_units.h"
#include "engine/io/text_header.h"

namespace palpate::io {

namespace {

constexpr int64_t kMostSegmentNumber = 1 << 20;

using Fields = std::map<std::string, std::string, std::less<>>;

constexpr TypeKey<std::string_view> kTypes[] = {
    {"signed char", ComponentType::i8},
    {"int8", ComponentType::i8},
    {"int8_t", ComponentType::i8},
    {"uchar", ComponentType::u8},
    {"unsigned char", ComponentType::u8},
    {"uint8", ComponentType::u8},
    {"uint8_t", ComponentType::u8},
    {"short", ComponentType::i16},
    {"short int", ComponentType::i16},
    {"signed short", ComponentType::i16},
    {"signed short int", ComponentType::i16},
    {"int16", ComponentType::i16},
    {"int16_t", ComponentType::i16},
    {"ushort", ComponentType::u16},
    {"unsigned short", ComponentType::u16},
    {"unsigned short int", ComponentType::u16},
    {"uint16", ComponentType::u16},
    {"uint16_t", ComponentType::u16},
    {"int", ComponentType::i32},
    {"signed int", ComponentType::i32},
    {"int32", ComponentType::i32},
    {"int32_t", ComponentType::i32},
    {"uint", ComponentType::u32},
    {"unsigned int", ComponentType::u32},
    {"uint32", ComponentType::u32},
    {"uint32_t", ComponentType::u32},
    {"longlong", ComponentType::i64},
    {"long long", ComponentType::i64},
    {"long long int", ComponentType::i64},
    {"signed long long", ComponentType::i64},
    {"signed long long int", ComponentType::i64},
    {"int64", ComponentType::i64},
    {"int64_t", ComponentType::i64},
    {"ulonglong", ComponentType::u64},
    {"unsigned long long", ComponentType::u64},
    {"unsigned long long int", ComponentType::u64},
    {"uint64", ComponentType::u64},
    {"uint64_t", ComponentType::u64},
    {"float", ComponentType::f32},
    {"double", ComponentType::f64},
};

// Empty where it is absent.
std::string_view field(const Fields& fields, std::string_view name) {
    const auto found = fields.find(name);
    return found == fields.end() ? std::string_view{} : std::string_view(found->second);
}

// Some fields have a second name.
std::string usual_name(std::string name) {
    constexpr std::pair<std::string_view, std::string_view> names[] = {{"datafile", "data file"},
                                                                       {"lineskip", "line skip"},
                                                                       {"byteskip", "byte skip"},
                                                                       {"axismins", "axis mins"}};
    for (const auto& [second, usual] : names)
        if (name == second)
            name = usual;
    return name;
}

// Keys and values of the user's own.
using Keys = std::map<std::string, std::string, std::less<>>;

// The numbers that keys such as "Segment12_ID" give segments; some writers leave gaps.
std::set<uint32_t> segment_numbers(const Keys& keys) {
    constexpr std::string_view start = "Segment";
    std::set<uint32_t> numbers;
    for (auto at = keys.lower_bound(start); at != keys.end() && at->first.starts_with(start);
         ++at) {
        const std::string_view rest = std::string_view(at->first).substr(start.size());
        const std::string_view digits = rest.substr(0, rest.find('_'));
        const std::optional<int64_t> number = parse_integer(digits);
        const std::string_view what = rest.substr(std::min(digits.size() + 1, rest.size()));
        if (number && *number >= 0 && *number <= kMostSegmentNumber &&
            (what == "ID" || what == "Name" || what == "LabelValue") && !at->second.empty())
            numbers.insert(static_cast<uint32_t>(*number));
    }
    return numbers;
}

// The segments of 3D Slicer.
std::vector<NrrdHeader::Segment> segments_of(const Keys& keys) {
    std::vector<NrrdHeader::Segment> segments;
    for (const uint32_t i : segment_numbers(keys)) {
        const auto find = [&](const char* what) {
            const auto found = keys.find(fmt::format("Segment{}_{}", i, what));
            return found == keys.end() ? std::string_view() : std::string_view(found->second);
        };
        NrrdHeader::Segment segment{i, {0, std::string(find("Name")), {}}, {}};
        segment.layer = parse_integer(find("Layer"));
        const std::string_view value = find("LabelValue");
        const std::optional<int64_t> label = parse_integer(value);
        if (label && *label >= 1 && *label <= 65535)
            segment.label.label = static_cast<uint32_t>(*label);
        else if (!value.empty())
            continue; // no label can have this value
        const auto color = parse_doubles(find("Color"));
        if (color && color->size() == 3 &&
            std::all_of(color->begin(), color->end(), [](double c) { return c >= 0 && c <= 1; }))
            segment.label.color = glm::dvec3((*color)[0], (*color)[1], (*color)[2]);
        segments.push_back(std::move(segment));
    }
    return segments;
}

// Splits the header into its fields; returns how many bytes it takes.
Result<size_t> split(const std::string& name, std::string_view text, Fields& fields, Keys& keys,
                     std::vector<std::string>& listed_files) {
    std::string_view rest = text;
    const std::optional<std::string_view> magic = take_line(rest);
    if (!magic || !magic->starts_with("NRRD000"))
        return fail("{}: expected a first line NRRD000x, found none", name);
    while (true) {
        std::optional<std::string_view> line = take_line(rest);
        if (!line && !rest.empty() && text.size() < kMostHeaderBytes) {
            line = rest; // the last line of a detached header may lack its line end
            rest = {};
        }
        if (!line) {
            if (text.size() < kMostHeaderBytes && fields.contains("data file"))
                return text.size(); // a detached header may end with the file
            return fail(
                "{}: expected an empty line at the end of the NRRD header, found none in "
                "{} bytes",
                name, text.size());
        }
        if (line->empty())
            return text.size() - rest.size();
        if (line->front() == '#')
            continue;
        const size_t colon = line->find(':');
        if (colon == std::string_view::npos)
            return fail("{}: expected \"field: value\", found \"{}\"", name, line->substr(0, 60));
        if (line->substr(colon, 2) == ":=") { // no field
            keys.emplace(trimmed(line->substr(0, colon)), trimmed(line->substr(colon + 2)));
            continue;
        }
        const std::string key = usual_name(lower_case(trimmed(line->substr(0, colon))));
        if (!fields.emplace(key, trimmed(line->substr(colon + 1))).second)
            return fail("{}: has two fields \"{}\"", name, key);
        if (key == "data file" && is_list_mark(field(fields, key))) {
            if (text.size() >= kMostHeaderBytes)
                return fail("{}: expected a list of data files within {} bytes, found a longer one",
                            name, kMostHeaderBytes);
            listed_files = names_in(rest); // the last field: names follow, a line each
            return text.size();
        }
    }
}

// "(1,0,0) none (0, 1, 0)": a vector or nothing for each axis.
std::optional<std::vector<std::optional<std::vector<double>>>> parse_vectors(
    std::string_view text) {
    std::vector<std::optional<std::vector<double>>> vectors;
    for (text = trimmed(text); !text.empty(); text = trimmed(text)) {
        if (text.starts_with("none")) {
            vectors.emplace_back();
            text.remove_prefix(4);
            continue;
        }
        const size_t end = text.find(')');
        if (text.front() != '(' || end == std::string_view::npos)
            return {};
        std::string inside(text.substr(1, end - 1));
        for (char& c : inside)
            if (c == ',')
                c = ' ';
        std::optional<std::vector<double>> numbers = parse_doubles(inside);
        if (!numbers)
            return {};
        vectors.push_back(std::move(numbers));
        text.remove_prefix(end + 1);
    }
    return vectors;
}

// The spatial part of a vector of a space of two or three dimensions, or of three and time.
std::optional<glm::dvec3> spatial(const std::optional<std::vector<double>>& vector) {
    if (!vector || vector->size() < 2 || vector->size() > 4)
        return {};
    return glm::dvec3((*vector)[0], (*vector)[1], vector->size() == 2 ? 0 : (*vector)[2]);
}

std::string long_space_name(std::string space) {
    constexpr std::pair<std::string_view, std::string_view> names[] = {
        {"ras", "right-anterior-superior"},      {"las", "left-anterior-superior"},
        {"lps", "left-posterior-superior"},      {"rast", "right-anterior-superior-time"},
        {"last", "left-anterior-superior-time"}, {"lpst", "left-posterior-superior-time"}};
    for (const auto& [brief, full] : names)
        if (space == brief)
            space = full;
    if (space.ends_with("-time"))
        space.resize(space.size() - 5);
    return space;
}

// "mm" "mm" "mm", or without quotes: millimetres in each. Units that are no lengths count as the
// first that is one, or as millimetres; they are warned of unless they are of time or none.
std::vector<double> lengths_of(const std::string& name, std::string_view text,
                               std::vector<std::string>& warnings) {
    std::vector<std::string_view> units;
    if (text.find('"') == std::string_view::npos)
        units = words_of(text);
    while (true) {
        const size_t start = text.find('"');
        const size_t end = text.find('"', start + 1);
        if (start == std::string_view::npos || end == std::string_view::npos)
            break;
        units.push_back(text.substr(start + 1, end - start - 1));
        text.remove_prefix(end + 1);
    }
    std::vector<double> lengths;
    double usual = 0;
    for (const std::string_view unit : units) {
        lengths.push_back(length_in_mm(unit).value_or(0));
        if (usual == 0)
            usual = lengths.back();
        constexpr std::string_view none[] = {"",       "s",       "ms",   "us",   "sec",
                                             "second", "seconds", "none", "None", "???"};
        if (lengths.back() == 0 &&
            std::find(std::begin(none), std::end(none), unit) == std::end(none))
            warnings.push_back(fmt::format(
                "{}: expected a unit of length, found \"{}\"; {}", name, unit.substr(0, 40),
                usual == 0 || usual == 1 ? "mm are assumed"
                                         : "that of the axis before is assumed"));
    }
    for (double& length : lengths)
        if (length == 0)
            length = usual == 0 ? 1 : usual;
    return lengths;
}

void read_units(const std::string& name, const Fields& fields, NrrdHeader& header,
                std::vector<std::string>& warnings) {
    const std::vector<double> of_axes = lengths_of(name, field(fields, "units"), warnings);
    for (size_t i = 0; i < std::min(of_axes.size(), header.axes.size()); ++i)
        header.axes[i].mm_per_unit = of_axes[i];
    const std::vector<double> of_space = lengths_of(name, field(fields, "space units"), warnings);
    if (of_space.empty())
        return;
    header.mm_per_unit = glm::dvec3(of_space[0]);
    for (size_t i = 1; i < std::min<size_t>(of_space.size(), 3); ++i)
        (*header.mm_per_unit)[static_cast<int>(i)] = of_space[i];
}

Result<void> read_axes(const std::string& name, const Fields& fields, NrrdHeader& header) {
    const std::optional<int64_t> dimension = parse_integer(field(fields, "dimension"));
    if (!dimension || *dimension < 1 || *dimension > 16)
        return fail("{}: expected a dimension of 1 to 16, found \"{}\"", name,
                    field(fields, "dimension"));
    const auto count = static_cast<size_t>(*dimension);
    const std::optional<std::vector<int64_t>> sizes = parse_integers(field(fields, "sizes"));
    if (!sizes || sizes->size() != count)
        return fail("{}: expected {} sizes, found \"{}\"", name, count, field(fields, "sizes"));
    header.axes.resize(count);
    for (size_t i = 0; i < count; ++i) {
        header.axes[i].size = (*sizes)[i];
        if ((*sizes)[i] < 1 || (*sizes)[i] > INT32_MAX)
            return fail("{}: expected sizes of 1 to {}, found {}", name, INT32_MAX, (*sizes)[i]);
    }

    if (const std::string_view text = field(fields, "kinds"); !text.empty()) {
        const std::vector<std::string_view> kinds = words_of(text);
        if (kinds.size() != count)
            return fail("{}: expected {} kinds, found \"{}\"", name, count, text);
        for (size_t i = 0; i < count; ++i) {
            const std::string kind = lower_case(kinds[i]);
            header.axes[i].is_spatial =
                kind == "domain" || kind == "space" || kind == "???" || kind == "none";
            header.axes[i].is_list = kind == "list" || kind == "time";
        }
    }
    if (const std::string_view text = field(fields, "space directions"); !text.empty()) {
        const auto vectors = parse_vectors(text);
        if (!vectors || vectors->size() != count)
            return fail("{}: expected {} space directions, found \"{}\"", name, count, text);
        for (size_t i = 0; i < count; ++i) {
            NrrdHeader::Axis& axis = header.axes[i];
            axis.direction = spatial((*vectors)[i]);
            if ((*vectors)[i] && !axis.direction)
                return fail("{}: expected space directions of two to four numbers, found \"{}\"",
                            name, text);
            // Time has a vector too, in a space of four dimensions: its spatial part is zero.
            const bool is_time =
                (*vectors)[i] && (*vectors)[i]->size() == 4 && axis.direction == glm::dvec3(0);
            axis.is_spatial = axis.direction && !is_time;
        }
        return {};
    }
    if (const std::string_view text = field(fields, "spacings"); !text.empty()) {
        const std::optional<std::vector<double>> spacings = parse_doubles(text);
        if (!spacings || spacings->size() != count)
            return fail("{}: expected {} spacings, found \"{}\"", name, count, text);
        for (size_t i = 0; i < count; ++i)
            if (!std::isnan((*spacings)[i])) // nan: of no meaning for this axis
                header.axes[i].spacing = (*spacings)[i];
    }
    return {};
}

Result<void> read_payload_fields(const std::string& name, const Fields& fields,
                                 NrrdHeader& header) {
    const std::string type = lower_case(field(fields, "type"));
    const auto known = find_type(kTypes, std::string_view(type));
    if (!known)
        return fail("{}: expected a type of number, found \"{}\"", name, type);
    header.type = *known;

    const std::string encoding = lower_case(field(fields, "encoding"));
    if (encoding == "raw")
        header.encoding = NrrdHeader::Encoding::raw;
    else if (encoding == "gzip" || encoding == "gz")
        header.encoding = NrrdHeader::Encoding::gzip;
    else if (encoding == "ascii" || encoding == "text" || encoding == "txt")
        header.encoding = NrrdHeader::Encoding::ascii;
    else
        return fail(
            "{}: expected the encoding raw, gzip or ascii, found \"{}\", which cannot be "
            "read",
            name, encoding);

    const std::string endian = lower_case(field(fields, "endian"));
    header.big_endian = endian == "big";
    if (endian != "big" && endian != "little" &&
        !(endian.empty() && (header.encoding == NrrdHeader::Encoding::ascii ||
                             bytes_per_component(header.type) == 1)))
        return fail("{}: expected the endian big or little, found \"{}\"", name, endian);

    for (const auto& [key, member] : {std::pair{"line skip", &NrrdHeader::line_skip},
                                      std::pair{"byte skip", &NrrdHeader::byte_skip}}) {
        const std::string_view text = field(fields, key);
        if (text.empty())
            continue;
        const std::optional<int64_t> value = parse_integer(text);
        const int64_t least = member == &NrrdHeader::byte_skip ? -1 : 0;
        if (!value || *value < least)
            return fail("{}: expected a {} of {} or more, found \"{}\"", name, key, least, text);
        header.*member = *value;
    }
    header.data_file = field(fields, "data file");
    return {};
}

} // namespace

Result<NrrdHeader> parse_nrrd_header(const std::string& name, std::string_view text,
                                     std::vector<std::string>& warnings) {
    Fields fields;
    NrrdHeader header;
    Keys keys;
    PALPATE_TRY(header.bytes, split(name, text, fields, keys, header.listed_files));
    header.segments = segments_of(keys);
    if (const auto modality = keys.find("modality"); modality != keys.end())
        header.modality = modality->second;
    PALPATE_TRY(read_payload_fields(name, fields, header));
    PALPATE_TRY(read_axes(name, fields, header));
    if (!header.segments.empty()) // an axis beside space is that of layers
        for (NrrdHeader::Axis& axis : header.axes)
            axis.is_list = axis.is_list || !axis.is_spatial;
    read_units(name, fields, header, warnings);

    if (!field(fields, "axis mins").empty())
        warnings.push_back(
            fmt::format("{}: its axis mins are not used; a space origin would be", name));
    header.space = long_space_name(lower_case(field(fields, "space")));
    if (const std::string_view origin = field(fields, "space origin"); !origin.empty()) {
        const auto vectors = parse_vectors(origin);
        if (vectors && vectors->size() == 1)
            header.origin = spatial((*vectors)[0]);
        if (!header.origin)
            return fail("{}: expected a space origin of two to four numbers, found \"{}\"", name,
                        origin);
    }
    return header;
}

} // namespace palpate::io
