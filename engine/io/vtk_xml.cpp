#include "engine/io/vtk_xml.h"

#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <pugixml.hpp>
#include <type_traits>

namespace palpate::io {

namespace {

constexpr TypeKey<std::string_view> kVtkTypes[] = {
    {"UInt8", ComponentType::u8},    {"Int8", ComponentType::i8},
    {"UInt16", ComponentType::u16},  {"Int16", ComponentType::i16},
    {"UInt32", ComponentType::u32},  {"Int32", ComponentType::i32},
    {"UInt64", ComponentType::u64},  {"Int64", ComponentType::i64},
    {"Float32", ComponentType::f32}, {"Float64", ComponentType::f64},
};

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

uint64_t word_at(const std::string& bytes, size_t index, const VtkLayout& layout) {
    uint64_t word = 0;
    for (size_t i = 0; i < layout.word_bytes; ++i) {
        const size_t from = layout.big_endian ? i : layout.word_bytes - 1 - i;
        word = word << 8 | static_cast<unsigned char>(bytes[index * layout.word_bytes + from]);
    }
    return word;
}

// Sizes first, then blocks of zlib: [blocks][block bytes][last block bytes][packed bytes]...
Result<void> unpack(VtkSource source, const VtkLayout& layout, std::span<std::byte> out) {
    VtkSource ahead = source;
    PALPATE_TRY(const std::string count, ahead.take(3 * layout.word_bytes));
    const uint64_t blocks = word_at(count, 0, layout);
    if (blocks > source.most_bytes())
        return fail("claims {} blocks of data in {} bytes", blocks, source.most_bytes());
    PALPATE_TRY(const std::string sizes, source.take((3 + blocks) * layout.word_bytes));
    uint64_t total = 0;
    for (uint64_t i = 0; i < blocks; ++i) {
        const uint64_t one = word_at(sizes, 3 + i, layout);
        if (one > source.most_bytes() || (total += one) > source.most_bytes())
            return fail("claims more packed bytes than its {}", source.most_bytes());
    }
    PALPATE_TRY(const std::string packed, source.take(total)); // the blocks are one run
    size_t done = 0, at = 0;
    for (uint64_t i = 0; i < blocks; ++i) {
        const uint64_t bytes = word_at(sizes, 3 + i, layout);
        uLongf length = out.size() - done;
        const int status = ::uncompress(reinterpret_cast<Bytef*>(out.data() + done), &length,
                                        reinterpret_cast<const Bytef*>(packed.data() + at), bytes);
        if (status != Z_OK)
            return fail("block {} of its compressed data is damaged", i);
        done += length;
        at += bytes;
    }
    if (done != out.size())
        return fail("expected {} bytes of data, found {}", out.size(), done);
    return {};
}

} // namespace

std::optional<ComponentType> vtk_type(std::string_view name) {
    return find_type(kVtkTypes, name);
}

VtkXml split_appended(std::string_view text) {
    const size_t tag = text.find("<AppendedData");
    if (tag == std::string::npos)
        return {std::string(text), {}};
    const size_t open = text.find('>', tag);
    const size_t start = open == std::string::npos ? open : text.find('_', open);
    if (start == std::string::npos)
        return {std::string(text), {}};
    return {std::string(text.substr(0, open)) + "/></VTKFile>", text.substr(start + 1)};
}

Result<pugi::xml_node> parse_vtk(const std::string& name, const VtkXml& split,
                                 std::string_view kind, const char* words,
                                 pugi::xml_document& document) {
    const pugi::xml_parse_result parsed = document.load_buffer(split.xml.data(), split.xml.size());
    if (!parsed)
        return fail("{}: is damaged XML: {} at byte {}", name, parsed.description(), parsed.offset);
    const pugi::xml_node file = document.child("VTKFile");
    const std::string_view found = file.attribute("type").value();
    if (found != kind)
        return fail("{}: is a VTK file of kind {}, expected {} ({})", name,
                    found.empty() ? "none" : found.substr(0, 40), kind, words);
    return file;
}

Result<VtkLayout> vtk_layout(const std::string& name, const pugi::xml_node& file) {
    const std::string compressor = file.attribute("compressor").value();
    if (!compressor.empty() && compressor != "vtkZLibDataCompressor")
        return fail("{}: is compressed by {}, expected vtkZLibDataCompressor or none", name,
                    compressor);
    VtkLayout layout;
    layout.packed = !compressor.empty();
    layout.big_endian = std::string_view(file.attribute("byte_order").value()) == "BigEndian";
    layout.word_bytes = std::string_view(file.attribute("header_type").value()) == "UInt64" ? 8 : 4;
    layout.appended_base64 =
        std::string_view(file.child("AppendedData").attribute("encoding").value()) == "base64";
    return layout;
}

Result<std::string> VtkSource::take(size_t bytes) {
    if (base64)
        return take_base64(text, bytes);
    if (bytes > text.size())
        return fail("its data end too early: expected {} bytes, found {}", bytes, text.size());
    std::string out(text.substr(0, bytes));
    text.remove_prefix(bytes);
    return out;
}

Result<uint64_t> array_bytes(VtkSource source, const VtkLayout& layout) {
    PALPATE_TRY(const std::string head, source.take((layout.packed ? 3 : 1) * layout.word_bytes));
    const uint64_t first = word_at(head, 0, layout);
    if (!layout.packed)
        return first;
    // Blocks, the bytes of each but for a last partial one, and the bytes of that.
    const uint64_t each = word_at(head, 1, layout), last = word_at(head, 2, layout);
    if (first > source.most_bytes() || each > uint64_t{1} << 27 || last > each)
        return fail("claims {} blocks of {} bytes", first, each);
    return first == 0 ? 0 : (last == 0 ? first : first - 1) * each + last;
}

Result<void> fill(VtkSource source, const VtkLayout& layout, std::span<std::byte> out) {
    if (layout.packed)
        return unpack(source, layout, out);
    // The size and the data are one run of base64.
    PALPATE_TRY(const std::string bytes, source.take(layout.word_bytes + out.size()));
    if (word_at(bytes, 0, layout) != out.size())
        return fail("expected {} bytes of data, found {}", out.size(), word_at(bytes, 0, layout));
    std::memcpy(out.data(), bytes.data() + layout.word_bytes, out.size());
    return {};
}

Result<void> fill_from_text(std::string_view text, ComponentType type, std::span<std::byte> out) {
    constexpr std::string_view white{" \t\r\n\v\f"};
    return visit_component(type, [&](auto t) -> Result<void> {
        using T = decltype(t);
        const std::span<T> numbers(reinterpret_cast<T*>(out.data()), out.size() / sizeof(T));
        size_t found = 0;
        for (;;) {
            text.remove_prefix(std::min(text.size(), text.find_first_not_of(white)));
            if (text.empty())
                break;
            const std::string_view word = text.substr(0, text.find_first_of(white));
            if (found == numbers.size())
                return fail("expected {} numbers, found more", numbers.size());
            // Through double, so that what is too small for a float is 0.
            std::conditional_t<std::is_floating_point_v<T>, double, T> number{};
            const char* const end = word.data() + word.size();
            const auto [stop, problem] = std::from_chars(word.data(), end, number);
            if (problem != std::errc{} || stop != end)
                return fail("expected a number of type {}, found \"{}\"", name_of(type),
                            word.substr(0, 40));
            numbers[found] = static_cast<T>(number);
            ++found;
            text.remove_prefix(word.size());
        }
        if (found != numbers.size())
            return fail("expected {} numbers, found {}", numbers.size(), found);
        return {};
    });
}

} // namespace palpate::io
