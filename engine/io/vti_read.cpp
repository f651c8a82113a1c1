#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <fstream>
#include <pugixml.hpp>

#include "engine/io/affine.h"
#include "engine/io/formats.h"
#include "engine/io/payload.h"
#include "engine/io/text_header.h"

// VTK XML image data, "XML File Formats" of the VTK User's Guide: one piece, its point scalars as
// text, base64 or appended bytes, packed by zlib or not.
namespace palpate::io {

namespace {

struct Type {
    std::string_view name;
    ComponentType type;
};
constexpr Type kTypes[] = {
    {"UInt8", ComponentType::u8},    {"Int8", ComponentType::i8},
    {"UInt16", ComponentType::u16},  {"Int16", ComponentType::i16},
    {"UInt32", ComponentType::u32},  {"Int32", ComponentType::i32},
    {"UInt64", ComponentType::u64},  {"Int64", ComponentType::i64},
    {"Float32", ComponentType::f32}, {"Float64", ComponentType::f64},
};

// The document without its appended bytes, which are no XML, and those bytes.
struct Split {
    std::string xml;
    std::string_view appended; // after the "_"; empty when there are none
};

Split split_appended(const std::string& text) {
    const size_t tag = text.find("<AppendedData");
    if (tag == std::string::npos)
        return {text, {}};
    const size_t open = text.find('>', tag);
    const size_t start = open == std::string::npos ? open : text.find('_', open);
    if (start == std::string::npos)
        return {text, {}};
    return {text.substr(0, open) + "/></VTKFile>", std::string_view(text).substr(start + 1)};
}

// Decodes base64 up to `bytes` bytes, passing over white space; takes what it read off `text`.
Result<std::string> take_base64(std::string_view& text, size_t bytes) {
    const auto value = [](char c) {
        if (c >= 'A' && c <= 'Z')
            return c - 'A';
        if (c >= 'a' && c <= 'z')
            return c - 'a' + 26;
        if (c >= '0' && c <= '9')
            return c - '0' + 52;
        return c == '+' ? 62 : c == '/' ? 63 : -1;
    };
    std::string out;
    size_t at = 0;
    while (out.size() < bytes) {
        char quad[4];
        size_t count = 0;
        for (; at < text.size() && count < 4; ++at)
            if (value(text[at]) >= 0 || text[at] == '=')
                quad[count++] = text[at];
            else if (text[at] != ' ' && text[at] != '\n' && text[at] != '\r' && text[at] != '\t')
                return fail("its base64 is damaged");
        if (count < 4)
            return fail("its data end too early: expected {} bytes more", bytes - out.size());
        uint32_t word = 0;
        for (const char c : quad)
            word = word << 6 | static_cast<uint32_t>(std::max(0, value(c)));
        const size_t whole = quad[3] != '=' ? 3 : quad[2] != '=' ? 2 : 1;
        for (size_t i = 0; i < whole; ++i)
            out.push_back(static_cast<char>(word >> (16 - 8 * i)));
        if (whole < 3)
            break; // the end of a run
    }
    if (out.size() < bytes)
        return fail("its data end too early: expected {} bytes more", bytes - out.size());
    text.remove_prefix(at);
    out.resize(bytes);
    return out;
}

// One array's bytes as they lie in the file: base64 in runs, or raw.
struct Source {
    std::string_view text;
    bool base64 = true;

    Result<std::string> take(size_t bytes) {
        if (base64)
            return take_base64(text, bytes);
        if (bytes > text.size())
            return fail("its data end too early: expected {} bytes, found {}", bytes, text.size());
        std::string out(text.substr(0, bytes));
        text.remove_prefix(bytes);
        return out;
    }
    uint64_t most_bytes() const { return base64 ? text.size() / 4 * 3 + 3 : text.size(); }
};

struct Layout {
    bool big_endian = false;
    size_t word_bytes = 4; // of the sizes before the data
    bool packed = false;
};

uint64_t word_at(const std::string& bytes, size_t index, const Layout& layout) {
    uint64_t word = 0;
    for (size_t i = 0; i < layout.word_bytes; ++i) {
        const size_t from = layout.big_endian ? i : layout.word_bytes - 1 - i;
        word = word << 8 | static_cast<unsigned char>(bytes[index * layout.word_bytes + from]);
    }
    return word;
}

// Sizes first, then blocks of zlib: [blocks][block bytes][last block bytes][packed bytes]...
Result<void> unpack(Source source, const Layout& layout, std::span<std::byte> out) {
    Source ahead = source;
    const Result<std::string> count = ahead.take(3 * layout.word_bytes);
    if (!count)
        return fail("{}", count.error().message);
    const uint64_t blocks = word_at(*count, 0, layout);
    if (blocks > source.most_bytes())
        return fail("claims {} blocks of data in {} bytes", blocks, source.most_bytes());
    const Result<std::string> sizes = source.take((3 + blocks) * layout.word_bytes);
    if (!sizes)
        return fail("{}", sizes.error().message);
    uint64_t total = 0;
    for (uint64_t i = 0; i < blocks; ++i) {
        const uint64_t one = word_at(*sizes, 3 + i, layout);
        if (one > source.most_bytes() || (total += one) > source.most_bytes())
            return fail("claims more packed bytes than its {}", source.most_bytes());
    }
    const Result<std::string> packed = source.take(total); // the blocks are one run
    if (!packed)
        return fail("{}", packed.error().message);
    size_t done = 0, at = 0;
    for (uint64_t i = 0; i < blocks; ++i) {
        const uint64_t bytes = word_at(*sizes, 3 + i, layout);
        uLongf length = out.size() - done;
        const int status = ::uncompress(reinterpret_cast<Bytef*>(out.data() + done), &length,
                                        reinterpret_cast<const Bytef*>(packed->data() + at), bytes);
        if (status != Z_OK)
            return fail("block {} of its compressed data is damaged", i);
        done += length;
        at += bytes;
    }
    if (done != out.size())
        return fail("expected {} bytes of voxels, found {}", out.size(), done);
    return {};
}

Result<void> fill(Source source, const Layout& layout, std::span<std::byte> out) {
    if (layout.packed)
        return unpack(source, layout, out);
    // The size and the data are one run of base64.
    const Result<std::string> bytes = source.take(layout.word_bytes + out.size());
    if (!bytes)
        return fail("{}", bytes.error().message);
    if (word_at(*bytes, 0, layout) != out.size())
        return fail("expected {} bytes of voxels, found {}", out.size(),
                    word_at(*bytes, 0, layout));
    std::memcpy(out.data(), bytes->data() + layout.word_bytes, out.size());
    return {};
}

Result<void> fill_from_text(std::string_view text, ComponentType type, std::span<std::byte> out) {
    return visit_component(type, [&](auto t) -> Result<void> {
        using T = decltype(t);
        const std::span<T> numbers(reinterpret_cast<T*>(out.data()), out.size() / sizeof(T));
        const auto words = words_of(text);
        if (words.size() != numbers.size())
            return fail("expected {} numbers, found {}", numbers.size(), words.size());
        for (size_t i = 0; i < words.size(); ++i) {
            const char* const end = words[i].data() + words[i].size();
            if (std::from_chars(words[i].data(), end, numbers[i]).ptr != end)
                return fail("expected a number, found \"{}\"", words[i].substr(0, 40));
        }
        return {};
    });
}

Result<std::vector<double>> numbers_of(const pugi::xml_node& node, const char* key, size_t count,
                                       std::vector<double> absent) {
    const pugi::xml_attribute attribute = node.attribute(key);
    if (!attribute)
        return absent;
    const auto numbers = parse_doubles(attribute.value());
    if (!numbers || numbers->size() != count)
        return fail("expected {} numbers in {}, found \"{}\"", count, key, attribute.value());
    return *numbers;
}

struct Header {
    Grid grid;
    ComponentType type{};
    uint32_t components = 1;
    Layout layout;
    std::string format; // "ascii", "binary", "appended"
    std::string text;   // of the array, for the first two
    uint64_t offset = 0;
    bool appended_base64 = false;
};

Result<void> take_grid(const std::string& name, const pugi::xml_node& image, Header& header) {
    const auto extent = numbers_of(image.child("Piece"), "Extent", 6, {});
    const auto origin = numbers_of(image, "Origin", 3, {0, 0, 0});
    const auto spacing = numbers_of(image, "Spacing", 3, {1, 1, 1});
    const auto turned = numbers_of(image, "Direction", 9, {1, 0, 0, 0, 1, 0, 0, 0, 1});
    for (const auto* numbers : {&extent, &origin, &spacing, &turned})
        if (!*numbers)
            return fail("{}: {}", name, numbers->error().message);
    if (extent->size() != 6)
        return fail("{}: has no piece with an extent", name);
    glm::uvec3 size;
    glm::dmat3 steps;
    glm::dvec3 first;
    for (int axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<size_t>(axis);
        const double samples = (*extent)[2 * i + 1] - (*extent)[2 * i] + 1;
        if (!(samples >= 1 && samples <= 0xffffffffu))
            return fail("{}: claims {} samples on an axis, expected at least 1", name, samples);
        size[axis] = static_cast<uint32_t>(samples);
        for (size_t row = 0; row < 3; ++row)
            steps[axis][static_cast<int>(row)] = (*turned)[3 * row + i] * (*spacing)[i];
        first[axis] = (*extent)[2 * i];
    }
    // Origin is where index (0, 0, 0) would lie; the piece begins at its extent.
    const Result<Grid> grid = grid_from_columns(
        name, size, steps, glm::dvec3((*origin)[0], (*origin)[1], (*origin)[2]) + steps * first);
    if (!grid)
        return fail("{}", grid.error().message);
    header.grid = *grid;
    return {};
}

Result<Header> parse(const std::string& name, const std::string& xml) {
    pugi::xml_document document;
    const pugi::xml_parse_result parsed = document.load_buffer(xml.data(), xml.size());
    if (!parsed)
        return fail("{}: is damaged XML: {} at byte {}", name, parsed.description(), parsed.offset);
    const pugi::xml_node file = document.child("VTKFile");
    const std::string kind = file.attribute("type").value();
    if (kind != "ImageData")
        return fail("{}: is a VTK file of kind {}, expected ImageData (a volume)", name,
                    kind.empty() ? "none" : kind);
    const pugi::xml_node image = file.child("ImageData");
    if (!image.child("Piece") || image.child("Piece").next_sibling("Piece"))
        return fail("{}: expected one piece", name);
    Header header;
    if (Result<void> taken = take_grid(name, image, header); !taken)
        return pass_on(taken);

    const pugi::xml_node points = image.child("Piece").child("PointData");
    const std::string wanted = points.attribute("Scalars").value();
    pugi::xml_node array = points.find_child_by_attribute("DataArray", "Name", wanted.c_str());
    if (!array)
        array = points.child("DataArray");
    if (!array)
        return fail("{}: has no point scalars", name);
    const std::string type = array.attribute("type").value();
    const auto* known = std::find_if(std::begin(kTypes), std::end(kTypes),
                                     [&](const Type& t) { return t.name == type; });
    if (known == std::end(kTypes))
        return fail("{}: its samples are of type {}, which is not read", name, type);
    header.type = known->type;
    header.components = array.attribute("NumberOfComponents").as_uint(1);
    header.format = array.attribute("format").as_string("ascii");
    header.text = array.text().get();
    header.offset = array.attribute("offset").as_ullong(0);
    header.appended_base64 =
        std::string_view(file.child("AppendedData").attribute("encoding").value()) == "base64";
    const std::string compressor = file.attribute("compressor").value();
    if (!compressor.empty() && compressor != "vtkZLibDataCompressor")
        return fail("{}: is compressed by {}, expected vtkZLibDataCompressor or none", name,
                    compressor);
    header.layout.packed = !compressor.empty();
    header.layout.big_endian =
        std::string_view(file.attribute("byte_order").value()) == "BigEndian";
    header.layout.word_bytes =
        std::string_view(file.attribute("header_type").value()) == "UInt64" ? 8 : 4;
    return header;
}

} // namespace

Result<Decoded> decode_vti(const DecodeRequest& request, VoxelSink& sink) {
    const std::string name = request.path.string();
    const Result<uint64_t> bytes = regular_file_bytes(request.path);
    if (!bytes)
        return fail("{}", bytes.error().message);
    if (Result<void> room = sink.reserve(name, 4 * *bytes); !room)
        return pass_on(room);
    std::string text(*bytes, '\0');
    std::ifstream in(request.path, std::ios::binary);
    in.read(text.data(), static_cast<std::streamsize>(text.size()));
    if (!in)
        return fail("{}: cannot be read whole", name);
    const Split split = split_appended(text);
    Result<Header> parsed = parse(name, split.xml);
    if (!parsed)
        return pass_on(parsed);
    const Header& header = *parsed;

    Decoded decoded;
    if (const Result<uint32_t> frame = choose_frame(request, 1, decoded.warnings); !frame)
        return fail("{}", frame.error().message);
    decoded.grid = header.grid;
    VoxelClaim claim;
    claim.size = header.grid.size;
    claim.type = header.type;
    claim.components = header.components;
    claim.source_bytes = *bytes;
    claim.most_expansion = header.format == "ascii" ? 4.0
                           : header.layout.packed   ? kDeflateExpansion
                                                    : kRawExpansion;
    const Result<std::span<std::byte>> voxels = sink.allocate(name, claim);
    if (!voxels)
        return fail("{}", voxels.error().message);
    Result<void> filled;
    if (header.format == "ascii") {
        filled = fill_from_text(header.text, header.type, *voxels);
    } else if (header.format == "appended") {
        if (header.offset > split.appended.size())
            return fail("{}: its data begin at byte {} of {}", name, header.offset,
                        split.appended.size());
        filled = fill({split.appended.substr(header.offset), header.appended_base64}, header.layout,
                      *voxels);
    } else {
        filled = fill({header.text, true}, header.layout, *voxels);
    }
    if (!filled)
        return fail("{}: {}", name, filled.error().message);
    if (header.layout.big_endian && header.format != "ascii")
        swap_bytes(*voxels, bytes_per_component(header.type));
    decoded.notes.push_back(name +
                            ": VTK files name no patient axes; x, y, z are taken as left, "
                            "posterior, superior");
    return decoded;
}

} // namespace palpate::io
