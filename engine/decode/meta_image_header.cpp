#include "engine/decode/meta_image_header.h"

#include <algorithm>
#include <charconv>
#include <map>

#include "engine/decode/file_list.h"
#include "engine/decode/length_units.h"
#include "engine/io/text_header.h"

namespace palpate::io {

namespace {

using Fields = std::map<std::string, std::string, std::less<>>;

// A field under any of its names; empty where it is absent.
std::string_view field(const Fields& fields, std::initializer_list<std::string_view> names) {
    for (const std::string_view name : names)
        if (const auto found = fields.find(name); found != fields.end())
            return found->second;
    return {};
}

bool is_true(std::string_view text) {
    return !text.empty() && (text.front() == 'T' || text.front() == 't' || text.front() == '1');
}

// Splits the header into its fields; ElementDataFile is the last. Returns how many bytes it takes.
Result<size_t> split(const std::string& name, std::string_view text, Fields& fields,
                     std::vector<std::string>& listed_files) {
    std::string_view rest = text;
    while (true) {
        std::optional<std::string_view> line = take_line(rest);
        if (!line && !trimmed(rest).empty() && text.size() < kMostHeaderBytes) {
            line = rest; // the last line of a detached header may lack its line end
            rest = {};
        }
        if (!line)
            return fail("{}: expected a field ElementDataFile, found none in {} bytes", name,
                        text.size());
        if (trimmed(*line).empty() || line->front() == '#')
            continue;
        const size_t equals = line->find_first_of("=:");
        if (equals == std::string_view::npos)
            return fail("{}: expected \"field = value\", found \"{}\"", name, line->substr(0, 60));
        const std::string key(trimmed(line->substr(0, equals)));
        if (!fields.emplace(key, trimmed(line->substr(equals + 1))).second)
            return fail("{}: has two fields {}", name, key);
        if (key == "ElementDataFile" && is_list_mark(fields.find(key)->second)) {
            if (text.size() >= kMostHeaderBytes)
                return fail("{}: expected a list of data files within {} bytes, found a longer one",
                            name, kMostHeaderBytes);
            listed_files = names_in(rest);
        }
        if (key == "ElementDataFile")
            return text.size() - rest.size();
    }
}

Result<ComponentType> element_type(const std::string& name, std::string_view type) {
    constexpr TypeKey<std::string_view> types[] = {
        {"MET_CHAR", ComponentType::i8},        {"MET_ASCII_CHAR", ComponentType::i8},
        {"MET_UCHAR", ComponentType::u8},       {"MET_SHORT", ComponentType::i16},
        {"MET_USHORT", ComponentType::u16},     {"MET_INT", ComponentType::i32},
        {"MET_UINT", ComponentType::u32},       {"MET_LONG", ComponentType::i32},
        {"MET_ULONG", ComponentType::u32},      {"MET_LONG_LONG", ComponentType::i64},
        {"MET_ULONG_LONG", ComponentType::u64}, {"MET_FLOAT", ComponentType::f32},
        {"MET_DOUBLE", ComponentType::f64}};
    if (const auto component = find_type(types, type))
        return *component;
    return fail("{}: expected an ElementType of one number, found \"{}\"", name, type);
}

Result<void> read_shape(const std::string& name, const Fields& fields, MetaImageHeader& header) {
    const std::optional<int64_t> count = parse_integer(field(fields, {"NDims"}));
    if (!count || *count < 1 || *count > 16)
        return fail("{}: expected an NDims of 1 to 16, found \"{}\"", name,
                    field(fields, {"NDims"}));
    const std::string_view text = field(fields, {"DimSize"});
    const std::optional<std::vector<int64_t>> sizes = parse_integers(text);
    if (!sizes || sizes->size() != static_cast<size_t>(*count))
        return fail("{}: expected {} sizes in DimSize, found \"{}\"", name, *count, text);
    for (const int64_t size : *sizes)
        if (size < 1 || size > INT32_MAX)
            return fail("{}: expected a DimSize of 1 to {}, found {}", name, INT32_MAX, size);
    header.sizes = *sizes;
    if (const std::string_view channels = field(fields, {"ElementNumberOfChannels"});
        !channels.empty()) {
        const std::optional<int64_t> components = parse_integer(channels);
        if (!components || *components < 1 || *components > INT32_MAX)
            return fail("{}: expected an ElementNumberOfChannels of 1 or more, found \"{}\"", name,
                        channels);
        header.components = static_cast<uint32_t>(*components);
    }
    return {};
}

// At least `least` numbers under any of the names; absent fields are fine and give none.
Result<std::vector<double>> numbers(const std::string& name, const Fields& fields,
                                    std::initializer_list<std::string_view> names, size_t least) {
    const std::string_view text = field(fields, names);
    if (text.empty())
        return std::vector<double>{};
    const std::optional<std::vector<double>> values = parse_doubles(text);
    if (!values || values->size() < least)
        return fail("{}: expected {} numbers in {}, found \"{}\"", name, least, *names.begin(),
                    text);
    return *values;
}

Result<void> read_geometry(const std::string& name, const Fields& fields, MetaImageHeader& header,
                           std::vector<std::string>& warnings) {
    const size_t count = header.sizes.size();
    const size_t spatial = std::min<size_t>(count, 3);
    PALPATE_TRY(
        const std::vector<double> matrix,
        numbers(name, fields, {"TransformMatrix", "Orientation", "Rotation"}, count * count));
    PALPATE_TRY(const std::vector<double> offset,
                numbers(name, fields, {"Offset", "Position", "Origin"}, count));
    PALPATE_TRY(const std::vector<double> spacing,
                numbers(name, fields, {"ElementSpacing", "ElementSize"}, count));
    double unit = 1;
    if (const std::string_view units = field(fields, {"DistanceUnits"}); !units.empty()) {
        const std::optional<double> found = length_in_mm(units);
        if (!found && units != "?")
            warnings.push_back(
                fmt::format("{}: expected DistanceUnits um, mm or cm, found \"{}\"; mm are assumed",
                            name, units));
        unit = found.value_or(1);
    }
    if (spacing.empty())
        warnings.push_back(fmt::format("{}: names no ElementSpacing; 1 mm is assumed", name));
    for (size_t i = 0; i < spatial; ++i) {
        const int axis = static_cast<int>(i);
        if (!matrix.empty()) // each run of numbers is the direction of one index axis
            for (size_t j = 0; j < spatial; ++j)
                header.steps[axis][static_cast<int>(j)] = matrix[i * count + j];
        header.steps[axis] *= (spacing.empty() ? 1.0 : spacing[i]) * unit;
        if (!offset.empty())
            header.origin[axis] = offset[i] * unit;
    }
    return {};
}

Result<void> read_payload_fields(const std::string& name, const Fields& fields,
                                 MetaImageHeader& header) {
    PALPATE_TRY(header.type, element_type(name, field(fields, {"ElementType"})));
    if (const std::string_view binary = field(fields, {"BinaryData"}); !binary.empty())
        header.binary = is_true(binary);
    header.compressed = is_true(field(fields, {"CompressedData"}));
    header.big_endian = is_true(field(fields, {"BinaryDataByteOrderMSB", "ElementByteOrderMSB"}));
    if (const std::string_view text = field(fields, {"HeaderSize"}); !text.empty()) {
        const std::optional<int64_t> size = parse_integer(text);
        if (!size || *size < -1)
            return fail("{}: expected a HeaderSize of -1 or more, found \"{}\"", name, text);
        header.header_size = *size;
    }
    for (const auto& [key, member] :
         {std::pair{"ElementToIntensityFunctionSlope", &Rescale::slope},
          std::pair{"ElementToIntensityFunctionOffset", &Rescale::intercept}}) {
        const std::string_view text = field(fields, {key});
        if (text.empty())
            continue;
        const std::optional<double> value = parse_double(text);
        if (!value)
            return fail("{}: expected a number in {}, found \"{}\"", name, key, text);
        header.rescale.*member = *value;
    }
    header.data_file = field(fields, {"ElementDataFile"});
    if (header.data_file.empty())
        return fail("{}: its ElementDataFile is empty", name);
    return {};
}

// "2D" or "2": how many axes each file of a list holds.
size_t dimensions_of(const MetaImageHeader& header) {
    const size_t axes = header.sizes.size(), usual = std::max<size_t>(axes, 2) - 1;
    const std::vector<std::string_view> words = words_of(header.data_file);
    size_t found = 0;
    if (words.size() > 1)
        std::from_chars(words[1].data(), words[1].data() + words[1].size(), found);
    return found == 0 || found > axes ? usual : found; // as MetaIO takes others
}

// The last axis has a file a sample: from 1 on by 1, unless numbers follow the pattern: the first,
// the last and the step.
Result<std::vector<std::string>> listed_names(const std::filesystem::path& path,
                                              const MetaImageHeader& header) {
    if (is_list_mark(header.data_file))
        return header.listed_files;
    constexpr int64_t most = int64_t{1} << 40; // refused below, but without overflow here
    const std::optional<FilePattern> pattern = file_pattern(header.data_file, 3);
    if (!pattern)
        return fail(
            "{}: expected one data file, \"LIST\" or \"name%03d.raw first last step\", found "
            "another "
            "list of them (\"{}\")",
            path.string(), header.data_file.substr(0, 80));
    const std::vector<int64_t>& numbers = pattern->numbers;
    const int64_t more = header.sizes.back() - 1;
    const int64_t first = numbers.empty() ? 1 : std::clamp<int64_t>(numbers[0], -most, most);
    const int64_t last =
        numbers.size() > 1 ? std::clamp<int64_t>(numbers[1], -most, most) : first + more;
    int64_t step = numbers.size() > 2 ? numbers[2] : 1;
    if (numbers.size() == 2 && more > 0 && (last - first) % more == 0)
        step = (last - first) / more;
    return names_of(path, pattern->pattern, first, last, step);
}

} // namespace

bool MetaImageHeader::is_local() const {
    return lower_case(data_file) == "local";
}

Result<std::vector<std::filesystem::path>> meta_image_data_files(const std::filesystem::path& path,
                                                                 const MetaImageHeader& header) {
    std::vector<std::filesystem::path> files;
    if (header.is_local())
        return files;
    const bool is_list = is_list_mark(header.data_file);
    if (!is_list && header.data_file.find('%') == std::string::npos) {
        PALPATE_TRY(files.emplace_back(), file_beside(path, header.data_file));
        return files;
    }
    PALPATE_TRY(const std::vector<std::string> names, listed_names(path, header));
    const uint64_t wanted =
        files_for(header.sizes, is_list ? dimensions_of(header) : header.sizes.size() - 1);
    if (names.size() != wanted)
        return fail("{}: expected {} data files in the list of them, found {}", path.string(),
                    wanted, names.size());
    return files_of(path, names);
}

Result<MetaImageHeader> parse_meta_image_header(const std::string& name, std::string_view text,
                                                std::vector<std::string>& warnings) {
    Fields fields;
    MetaImageHeader header;
    PALPATE_TRY(header.bytes, split(name, text, fields, header.listed_files));
    if (const std::string_view kind = field(fields, {"ObjectType"});
        !kind.empty() && kind != "Image")
        return fail("{}: expected an ObjectType Image, found \"{}\"", name, kind);
    PALPATE_TRY(read_shape(name, fields, header));
    PALPATE_TRY(read_geometry(name, fields, header, warnings));
    PALPATE_TRY(read_payload_fields(name, fields, header));
    if (const std::string_view modality = field(fields, {"Modality"});
        modality.starts_with("MET_MOD_") && modality != "MET_MOD_UNKNOWN" &&
        modality != "MET_MOD_OTHER")
        header.modality = modality.substr(8);
    return header;
}

} // namespace palpate::io
