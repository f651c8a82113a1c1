#include "engine/decode/meta_image_header.h"

#include <map>

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
Result<size_t> split(const std::string& name, std::string_view text, Fields& fields) {
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
        if (units == "um")
            unit = 0.001;
        else if (units == "cm")
            unit = 10;
        else if (units != "mm" && units != "?")
            warnings.push_back(
                fmt::format("{}: expected DistanceUnits um, mm or cm, found \"{}\"; mm are assumed",
                            name, units));
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

} // namespace

Result<MetaImageHeader> parse_meta_image_header(const std::string& name, std::string_view text,
                                                std::vector<std::string>& warnings) {
    Fields fields;
    MetaImageHeader header;
    PALPATE_TRY(header.bytes, split(name, text, fields));
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
