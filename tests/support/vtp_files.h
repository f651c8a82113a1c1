#pragma once

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

// VTK poly data as other programs write it, made without the code under test: a square of two
// polygons, a quad and a triangle, and a strip of two triangles, with labels 7, 8 and 9.
namespace palpate::vtp {

enum class Form { ascii, base64, appended_base64, appended_raw };

struct Style {
    Form form = Form::ascii;
    bool packed = false; // by zlib, in blocks of 24 bytes
    bool big_endian = false, wide_header = false;
};

inline std::string base64(const std::string& bytes) {
    const char* const letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string out;
    for (size_t i = 0; i < bytes.size(); i += 3) {
        unsigned word = 0;
        for (size_t k = 0; k < 3; ++k)
            word =
                word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0);
        for (size_t k = 0; k < 4; ++k)
            out += i + k > bytes.size() ? '=' : letters[word >> (18 - 6 * k) & 63];
    }
    return out;
}

template <class T>
std::string bytes_of(T value, bool big_endian) {
    std::string bytes(sizeof(T), '\0');
    std::memcpy(bytes.data(), &value, sizeof(T));
    if (big_endian)
        std::reverse(bytes.begin(), bytes.end());
    return bytes;
}

class Writer {
 public:
    explicit Writer(const Style& style) : style_(style) {}

    template <class T>
    std::string array(const char* type, const char* name, int components,
                      const std::vector<T>& values) {
        std::string tag = std::string("<DataArray type=\"") + type + "\" Name=\"" + name +
                          "\" NumberOfComponents=\"" + std::to_string(components) + "\" format=\"";
        if (style_.form == Form::ascii) {
            tag += "ascii\">\n";
            for (const T value : values)
                tag += std::to_string(value) + " ";
            return tag + "\n</DataArray>\n";
        }
        std::string raw;
        for (const T value : values)
            raw += bytes_of(value, style_.big_endian);
        const bool text = style_.form != Form::appended_raw;
        const std::string data = encoded(raw, text);
        if (style_.form == Form::base64)
            return tag + "binary\">\n   " + data + "\n</DataArray>\n";
        const std::string offset = std::to_string(appended_.size());
        appended_ += data;
        return tag + "appended\" offset=\"" + offset + "\"/>\n";
    }
    // A string is an array of its bytes and a 0.
    std::string string(const char* name, const std::string& text) {
        std::vector<int8_t> codes(text.begin(), text.end());
        codes.push_back(0);
        std::string tag = array("String", name, 1, codes);
        for (size_t at; (at = tag.find("DataArray")) != std::string::npos;)
            tag.erase(at, 4);
        return tag;
    }
    std::string file(const std::string& poly_data) const {
        std::string xml = "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\"";
        xml += style_.big_endian ? " byte_order=\"BigEndian\"" : " byte_order=\"LittleEndian\"";
        xml += style_.wide_header ? " header_type=\"UInt64\"" : " header_type=\"UInt32\"";
        if (style_.packed)
            xml += " compressor=\"vtkZLibDataCompressor\"";
        xml += ">\n<PolyData>\n" + poly_data + "</PolyData>\n";
        if (!appended_.empty())
            xml += std::string("<AppendedData encoding=\"") +
                   (style_.form == Form::appended_raw ? "raw" : "base64") + "\">\n_" + appended_ +
                   "\n</AppendedData>\n";
        return xml + "</VTKFile>\n";
    }

 private:
    std::string word(uint64_t value) const {
        return style_.wide_header ? bytes_of(value, style_.big_endian)
                                  : bytes_of(static_cast<uint32_t>(value), style_.big_endian);
    }
    std::string encoded(const std::string& raw, bool text) const {
        const auto written = [&](const std::string& bytes) { return text ? base64(bytes) : bytes; };
        if (!style_.packed)
            return written(word(raw.size()) + raw);
        constexpr size_t block = 24;
        const size_t blocks = (raw.size() + block - 1) / block;
        std::string header = word(blocks) + word(block) + word(raw.size() % block), packed;
        for (size_t i = 0; i < blocks; ++i) {
            const std::string part = raw.substr(i * block, block);
            std::string out(::compressBound(part.size()), '\0');
            uLongf length = out.size();
            ::compress(reinterpret_cast<Bytef*>(out.data()), &length,
                       reinterpret_cast<const Bytef*>(part.data()), part.size());
            header += word(length);
            packed += out.substr(0, length);
        }
        return written(header) + written(packed);
    }
    Style style_;
    std::string appended_;
};

// Points (0 0 0) (1 0 0) (1 1 0) (0 1 0) (2 0 0) (2 1 0), normals (0 0 1); a line comes first. The
// field data state `space`, where it is given, as 3D Slicer does.
inline std::string square(const Style& style, const std::string& space = "") {
    Writer out(style);
    std::vector<float> points{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 2, 0, 0, 2, 1, 0}, normals;
    for (int i = 0; i < 6; ++i)
        normals.insert(normals.end(), {0, 0, 1});
    using Ids = std::vector<int64_t>;
    std::string piece =
        space.empty() ? "" : "<FieldData>\n" + out.string("SPACE", space) + "</FieldData>\n";
    piece +=
        "<Piece NumberOfPoints=\"6\" NumberOfVerts=\"0\" NumberOfLines=\"1\" NumberOfStrips=\"1\" "
        "NumberOfPolys=\"2\">\n<PointData Normals=\"N\">\n";
    piece += out.array("Float32", "N", 3, normals) + "</PointData>\n<CellData>\n";
    piece += out.array("UInt16", "label", 1, std::vector<uint16_t>{1, 7, 8, 9});
    piece += "</CellData>\n<Points>\n" + out.array("Float32", "Points", 3, points);
    piece += "</Points>\n<Lines>\n" + out.array("Int64", "connectivity", 1, Ids{0, 5});
    piece += out.array("Int64", "offsets", 1, Ids{2});
    piece +=
        "</Lines>\n<Polys>\n" + out.array("Int64", "connectivity", 1, Ids{0, 1, 2, 3, 1, 4, 2});
    piece += out.array("Int64", "offsets", 1, Ids{4, 7});
    piece += "</Polys>\n<Strips>\n" + out.array("Int64", "connectivity", 1, Ids{1, 4, 2, 5});
    piece += out.array("Int64", "offsets", 1, Ids{4}) + "</Strips>\n</Piece>\n";
    return out.file(piece);
}

} // namespace palpate::vtp
