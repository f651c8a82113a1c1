#pragma once

#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

// Small valid files of each format, made on the spot.
namespace palpate::test {

namespace fs = std::filesystem;

// A folder of its own for a test, removed with it.
class Folder {
 public:
    explicit Folder(const std::string& name)
        : path_(fs::temp_directory_path() / ("palpate_" + name + std::to_string(::getpid()))) {
        fs::remove_all(path_);
        fs::create_directories(path_);
    }
    ~Folder() { fs::remove_all(path_); }
    fs::path operator/(const std::string& name) const { return path_ / name; }
    const fs::path& path() const { return path_; }

 private:
    fs::path path_;
};

inline void write(const fs::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
}

inline std::string little(uint64_t value, int bytes) {
    std::string text;
    for (int i = 0; i < bytes; ++i)
        text.push_back(static_cast<char>(value >> 8 * i));
    return text;
}

inline std::string legacy_vtk(bool ascii) {
    std::string text = "# vtk DataFile Version 3.0\ntitle\n" +
                       std::string(ascii ? "ASCII" : "BINARY") +
                       "\nDATASET STRUCTURED_POINTS\nDIMENSIONS 4 3 2\nSPACING 0.5 1 2\n"
                       "ORIGIN -1 2 3\nPOINT_DATA 24\nSCALARS v short 1\nLOOKUP_TABLE default\n";
    for (int i = 0; i < 24; ++i)
        text += ascii ? std::to_string(i * 11 - 100) + (i % 9 == 8 ? "\n" : " ")
                      : std::string{static_cast<char>((i * 11 - 100) >> 8),
                                    static_cast<char>(i * 11 - 100)};
    return text + "\n";
}

// The same samples as legacy_vtk, as text.
inline std::string vti() {
    std::string text =
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" "
        "byte_order=\"LittleEndian\">\n<ImageData WholeExtent=\"0 3 0 2 0 1\" Origin=\"-1 2 3\" "
        "Spacing=\"0.5 1 2\">\n<Piece Extent=\"0 3 0 2 0 1\"><PointData Scalars=\"v\">\n"
        "<DataArray type=\"Int16\" Name=\"v\" format=\"ascii\">";
    for (int i = 0; i < 24; ++i)
        text += std::to_string(i * 11 - 100) + " ";
    return text + "</DataArray></PointData></Piece></ImageData></VTKFile>\n";
}

// A grey PNG of 16 bits; rows of values.
std::string png(const std::vector<std::vector<uint16_t>>& rows);

// A grey BMP of 8 bits by a palette; as runs of one value each with `runs`. Rows of values.
std::string bmp(const std::vector<std::vector<uint8_t>>& rows, bool runs = false);

// A grey TIFF of 16 bits in two strips at most; rows of values.
std::string tiff(const std::vector<std::vector<uint16_t>>& rows, bool big_endian = false);

// A chunk of PNG with its length and checksum.
std::string png_chunk(const std::string& kind, const std::string& data);

// A grey baseline JPEG of 8 x 8 blocks, each of one value; rows of values 1 .. 254. A restart
// marker follows each `restart` blocks where that is above 0.
std::string jpeg(const std::vector<std::vector<int>>& blocks, int restart = 0);

} // namespace palpate::test
