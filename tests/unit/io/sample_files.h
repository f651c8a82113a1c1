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

// One axial CT slice of 8 x 4 samples, explicit little-endian, value = x + 10 y + 100 z - 1000 HU.
inline std::string dicom_slice(int z, double step_mm = 2.5) {
    const auto element = [](uint16_t group, uint16_t number, const std::string& vr,
                            std::string value) {
        if (value.size() % 2)
            value.push_back(vr == "UI" ? '\0' : ' ');
        const bool is_long = vr == "OW" || vr == "OB";
        return little(group, 2) + little(number, 2) + vr +
               (is_long ? little(0, 2) + little(value.size(), 4) : little(value.size(), 2)) + value;
    };
    const std::string kind = "1.2.840.10008.5.1.4.1.1.2";
    const std::string instance = "1.2.3.4." + std::to_string(z + 1);
    const std::string meta = element(2, 2, "UI", kind) + element(2, 3, "UI", instance) +
                             element(2, 0x10, "UI", "1.2.840.10008.1.2.1");
    std::string pixels;
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 8; ++x)
            pixels += little(static_cast<uint64_t>(x + 10 * y + 100 * z), 2);
    return std::string(128, '\0') + "DICM" + element(2, 0, "UL", little(meta.size(), 4)) + meta +
           element(8, 0x16, "UI", kind) + element(8, 0x18, "UI", instance) +
           element(8, 0x60, "CS", "CT") + element(8, 0x103e, "LO", "head") +
           element(0x20, 0x0d, "UI", "1.2.3") + element(0x20, 0x0e, "UI", "1.2.3.4") +
           element(0x20, 0x13, "IS", std::to_string(z + 1)) +
           element(0x20, 0x32, "DS", "-10\\20\\" + std::to_string(step_mm * z)) +
           element(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0") + element(0x28, 2, "US", little(1, 2)) +
           element(0x28, 4, "CS", "MONOCHROME2") + element(0x28, 0x10, "US", little(4, 2)) +
           element(0x28, 0x11, "US", little(8, 2)) + element(0x28, 0x30, "DS", "0.75\\0.5") +
           element(0x28, 0x100, "US", little(16, 2)) + element(0x28, 0x101, "US", little(16, 2)) +
           element(0x28, 0x102, "US", little(15, 2)) + element(0x28, 0x103, "US", little(1, 2)) +
           element(0x28, 0x1052, "DS", "-1000") + element(0x28, 0x1053, "DS", "1") +
           element(0x7fe0, 0x10, "OW", pixels);
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

// A chunk of PNG with its length and checksum.
std::string png_chunk(const std::string& kind, const std::string& data);

// A grey baseline JPEG of 8 x 8 blocks, each of one value; rows of values 1 .. 254. A restart
// marker follows each `restart` blocks where that is above 0.
std::string jpeg(const std::vector<std::vector<int>>& blocks, int restart = 0);

} // namespace palpate::test
