#include "engine/decode/affine.h"
#include "engine/decode/formats.h"
#include "engine/decode/payload.h"
#include "engine/io/text_header.h"

// VTK legacy files, "Simple Legacy Formats" of the VTK User's Guide: text lines, then numbers as
// text or as big-endian bytes.
namespace palpate::io {

namespace {

constexpr TypeKey<std::string_view> kVtkTypes[] = {
    {"unsigned_char", ComponentType::u8},   {"char", ComponentType::i8},
    {"unsigned_short", ComponentType::u16}, {"short", ComponentType::i16},
    {"unsigned_int", ComponentType::u32},   {"int", ComponentType::i32},
    {"unsigned_long", ComponentType::u64},  {"long", ComponentType::i64},
    {"vtktypeuint64", ComponentType::u64},  {"vtktypeint64", ComponentType::i64},
    {"float", ComponentType::f32},          {"double", ComponentType::f64},
};

struct VtkHeader {
    bool ascii = false;
    glm::uvec3 size{};
    glm::dvec3 spacing{1.0}, origin{};
    uint64_t points = 0;
    std::optional<ComponentType> type;
    uint32_t components = 1;
    uint64_t offset = 0; // of the first number
};

Result<glm::dvec3> three_numbers(std::string_view line) {
    const auto words = words_of(line);
    glm::dvec3 numbers;
    for (size_t i = 0; i < 3; ++i) {
        const auto number = words.size() == 4 ? parse_double(words[i + 1]) : std::nullopt;
        if (!number)
            return fail("expected three numbers in \"{}\"", line.substr(0, 60));
        numbers[static_cast<int>(i)] = *number;
    }
    return numbers;
}

Result<void> take_scalars(const std::vector<std::string_view>& words, VtkHeader& header) {
    if (words.size() < 3 || words.size() > 4)
        return fail("expected SCALARS with a name and a type");
    header.type = find_type(kVtkTypes, std::string_view(lower_case(words[2])));
    if (!header.type)
        return fail("its samples are of type {}, which is not read", words[2]);
    if (words.size() == 4) {
        const auto components = parse_integer(words[3]);
        if (!components || *components < 1 || *components > 4)
            return fail("expected 1 to 4 components, found {}", words[3]);
        header.components = static_cast<uint32_t>(*components);
    }
    return {};
}

// Takes in one line that starts with a keyword; the error has no file name yet.
Result<void> take_keyword(std::string_view line, VtkHeader& header) {
    const auto words = words_of(line);
    const std::string keyword = lower_case(words[0]);
    if (keyword == "dimensions") {
        PALPATE_TRY(const glm::dvec3 size, three_numbers(line));
        for (int axis = 0; axis < 3; ++axis)
            if (!(size[axis] >= 1 && size[axis] <= 0xffffffffu))
                return fail("claims {} samples on an axis, expected at least 1", size[axis]);
        header.size = size;
    } else if (keyword == "spacing" || keyword == "aspect_ratio") {
        PALPATE_TRY(header.spacing, three_numbers(line));
    } else if (keyword == "origin") {
        PALPATE_TRY(header.origin, three_numbers(line));
    } else if (keyword == "point_data") {
        const auto points = words.size() == 2 ? parse_integer(words[1]) : std::nullopt;
        if (!points || *points < 0)
            return fail("expected a number in \"{}\"", line.substr(0, 60));
        header.points = static_cast<uint64_t>(*points);
    } else if (keyword == "scalars") {
        return take_scalars(words, header);
    } else {
        return fail("has {} where SCALARS of points were expected", words[0].substr(0, 40));
    }
    return {};
}

Result<VtkHeader> parse(std::string_view all) {
    std::string_view text = all;
    VtkHeader header;
    const auto line = [&] { return take_line(text).value_or(std::string_view()); };
    if (!lower_case(line()).starts_with("# vtk datafile"))
        return fail("is no VTK legacy file");
    line(); // the title
    // The next line that is not blank; empty at the end of the file.
    const auto next_line = [&]() -> std::string_view {
        while (const std::optional<std::string_view> found = take_line(text))
            if (!trimmed(*found).empty())
                return trimmed(*found);
        return {};
    };
    const std::string kind = lower_case(next_line());
    if (kind != "ascii" && kind != "binary")
        return fail("expected ASCII or BINARY, found \"{}\"", kind.substr(0, 40));
    header.ascii = kind == "ascii";
    const std::string_view dataset = next_line();
    const auto words = words_of(dataset);
    if (words.size() != 2 || lower_case(words[0]) != "dataset")
        return fail("expected DATASET, found \"{}\"", dataset.substr(0, 60));
    if (lower_case(words[1]) != "structured_points")
        return fail("is a VTK file of kind {}, expected STRUCTURED_POINTS (a volume)",
                    words[1].substr(0, 40));
    while (!header.type) {
        const std::string_view found = next_line();
        if (found.empty())
            return fail("ends before its SCALARS");
        PALPATE_TRY(take_keyword(found, header));
    }
    std::string_view rest = text;
    if (const auto table = take_line(rest);
        table && lower_case(trimmed(*table)).starts_with("lookup_table"))
        text = rest;
    header.offset = all.size() - text.size();
    return header;
}

} // namespace

Result<Decoded> decode_vtk(const DecodeRequest& request, VoxelSink& sink) {
    const std::string name = request.path.string();
    PALPATE_TRY(const std::string beginning, load_beginning(name));
    const Result<VtkHeader> header = parse(beginning);
    if (!header)
        return fail("{}: {}", name, header.error().message);
    const uint64_t samples = uint64_t{header->size.x} * header->size.y * header->size.z;
    if (header->points != samples)
        return fail("{}: claims {} x {} x {} samples, but has {} points", name, header->size.x,
                    header->size.y, header->size.z, header->points);
    Decoded decoded;
    PALPATE_TRY(choose_frame(request, 1, decoded.warnings));
    PALPATE_TRY(decoded.grid, grid_from_columns(name, header->size,
                                                {{header->spacing.x, 0, 0},
                                                 {0, header->spacing.y, 0},
                                                 {0, 0, header->spacing.z}},
                                                header->origin));

    Payload payload;
    payload.file = request.path;
    payload.encoding = header->ascii ? Encoding::ascii : Encoding::raw;
    payload.offset = header->offset;
    payload.type = *header->type;
    payload.big_endian = true;
    payload.size = header->size;
    payload.components = header->components;
    std::vector<std::string> surplus; // other arrays may follow, which are no concern
    PALPATE_TRY(read_payload(payload, sink, surplus));
    decoded.notes.push_back(name +
                            ": VTK files name no patient axes; x, y, z are taken as left, "
                            "posterior, superior");
    return decoded;
}

} // namespace palpate::io
