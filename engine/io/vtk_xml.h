#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "engine/io/decoder.h"

namespace pugi {
class xml_document;
class xml_node;
} // namespace pugi

// XML files of VTK ("XML File Formats" of the VTK User's Guide): arrays of numbers as text, base64
// or appended bytes, packed by zlib or not. Errors name no file except where a comment says so.
namespace palpate::io {

// The type that VTK calls "UInt8" .. "Float64".
std::optional<ComponentType> vtk_type(std::string_view name);

// The document without its appended bytes, which are no XML, and those bytes.
struct VtkXml {
    std::string xml;
    std::string_view appended; // after the "_"; empty when there are none
};
VtkXml split_appended(std::string_view text); // which must outlive it

// Parses a document of one kind, such as "ImageData", which errors call `words` ("a volume");
// returns <VTKFile>, which `document` holds. Errors name the file.
Result<pugi::xml_node> parse_vtk(const std::string& name, const VtkXml& split,
                                 std::string_view kind, const char* words,
                                 pugi::xml_document& document);

// How arrays that are not text are written.
struct VtkLayout {
    bool big_endian = false;
    size_t word_bytes = 4; // of the sizes before the data
    bool packed = false;
    bool appended_base64 = false;
};

// From the attributes of <VTKFile>; an error names the file, and compressors that are not read.
Result<VtkLayout> vtk_layout(const std::string& name, const pugi::xml_node& file);

// One array's bytes as they lie in the file: base64 in runs, or raw.
struct VtkSource {
    std::string_view text;
    bool base64 = true;

    Result<std::string> take(size_t bytes);
    uint64_t most_bytes() const { return base64 ? text.size() / 4 * 3 + 3 : text.size(); }
};

// How many bytes an array that is not text holds, as its own head states it.
Result<uint64_t> array_bytes(VtkSource source, const VtkLayout& layout);

// Fills `out` with an array of exactly its size, in the byte order of the file.
Result<void> fill(VtkSource source, const VtkLayout& layout, std::span<std::byte> out);

// The same from numbers in decimal, in native byte order.
Result<void> fill_from_text(std::string_view text, ComponentType type, std::span<std::byte> out);

} // namespace palpate::io
