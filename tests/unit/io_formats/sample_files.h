#pragma once

#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

// Small valid files of each format, made byte by byte and without the code under test.
namespace palpate::io {

inline const std::vector<double> kOneToTwelve{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};

// A folder of this test's own, removed at its end.
class TemporaryFolder {
 public:
    TemporaryFolder() {
        std::string name = (std::filesystem::temp_directory_path() / "palpate_XXXXXX").string();
        path_ = ::mkdtemp(name.data());
    }
    ~TemporaryFolder() { std::filesystem::remove_all(path_); }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;

    // Writes a file and returns its path. An old one is removed, not cut: some file systems wait
    // for the disk when a file is cut to nothing and written again.
    std::filesystem::path write(const std::string& name, const std::string& bytes) const {
        const std::filesystem::path path = path_ / name;
        std::filesystem::remove(path);
        std::ofstream(path, std::ios::binary)
            .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
        return path;
    }
    const std::filesystem::path& path() const { return path_; }

 private:
    std::filesystem::path path_;
};

inline std::string read_bytes(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

template <class T>
std::string bytes_of(T value, bool big_endian = false) {
    std::string bytes(sizeof(T), '\0');
    std::memcpy(bytes.data(), &value, sizeof(T));
    if (big_endian)
        std::reverse(bytes.begin(), bytes.end());
    return bytes;
}

template <class T>
std::string bytes_of(const std::vector<T>& values, bool big_endian = false) {
    std::string bytes;
    for (const T value : values)
        bytes += bytes_of(value, big_endian);
    return bytes;
}

// window_bits as zlib takes them: 31 writes gzip, 15 zlib.
inline std::string deflated(const std::string& bytes, int window_bits = 31) {
    z_stream stream{};
    deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY);
    std::string packed(deflateBound(&stream, bytes.size()) + 32, '\0');
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(packed.data());
    stream.avail_out = static_cast<uInt>(packed.size());
    deflate(&stream, Z_FINISH);
    packed.resize(stream.total_out);
    deflateEnd(&stream);
    return packed;
}

// A NIfTI header whose fields are set by their byte offset in nifti1.h or nifti2.h.
class NiftiBytes {
 public:
    // 3 x 2 x 2 voxels of i16 with an sform of 2, 3 and 4 mm and no shift, in one file.
    explicit NiftiBytes(int version = 1, bool big_endian = false)
        : version_(version), big_endian_(big_endian), bytes_(version == 1 ? 352 : 544, '\0') {
        if (version == 1) {
            put<int32_t>(0, 348);
            bytes_.replace(344, 4, std::string("n+1\0", 4));
        } else {
            put<int32_t>(0, 540);
            bytes_.replace(4, 8, std::string("n+2\0\r\n\x1a\n", 8));
        }
        dim({3, 3, 2, 2, 1, 1, 1, 1});
        datatype(4);
        pixdim({1, 2, 3, 4, 1, 1, 1, 1});
        vox_offset(static_cast<double>(bytes_.size()));
        sform(1, {2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 4, 0});
        units(2);
    }

    template <class T>
    NiftiBytes& put(size_t offset, T value) {
        bytes_.replace(offset, sizeof(T), bytes_of(value, big_endian_));
        return *this;
    }
    NiftiBytes& dim(const std::vector<int64_t>& dims) {
        for (size_t i = 0; i < dims.size(); ++i)
            version_ == 1 ? put<int16_t>(40 + 2 * i, static_cast<int16_t>(dims[i]))
                          : put<int64_t>(16 + 8 * i, dims[i]);
        return *this;
    }
    NiftiBytes& datatype(int16_t code) { return put<int16_t>(version_ == 1 ? 70 : 12, code); }
    NiftiBytes& pixdim(const std::vector<double>& values) { return reals(76, 104, values); }
    NiftiBytes& vox_offset(double offset) {
        return version_ == 1 ? put<float>(108, static_cast<float>(offset))
                             : put<int64_t>(168, static_cast<int64_t>(offset));
    }
    NiftiBytes& scale(double slope, double inter) { return reals(112, 176, {slope, inter}); }
    NiftiBytes& units(int code) {
        return version_ == 1 ? put<uint8_t>(123, static_cast<uint8_t>(code))
                             : put<int32_t>(500, code);
    }
    NiftiBytes& sform(int code, const std::vector<double>& rows) {
        version_ == 1 ? put<int16_t>(254, static_cast<int16_t>(code)) : put<int32_t>(348, code);
        return reals(280, 400, rows);
    }
    NiftiBytes& qform(int code, const std::vector<double>& quaternion_and_offset) {
        version_ == 1 ? put<int16_t>(252, static_cast<int16_t>(code)) : put<int32_t>(344, code);
        return reals(256, 352, quaternion_and_offset);
    }

    std::string with(const std::string& voxels) const { return bytes_ + voxels; }

 private:
    NiftiBytes& reals(size_t offset_1, size_t offset_2, const std::vector<double>& values) {
        for (size_t i = 0; i < values.size(); ++i)
            version_ == 1 ? put<float>(offset_1 + 4 * i, static_cast<float>(values[i]))
                          : put<double>(offset_2 + 8 * i, values[i]);
        return *this;
    }
    int version_;
    bool big_endian_;
    std::string bytes_;
};

// 1 .. 12 as i16: the voxels of a 3 x 2 x 2 volume.
inline std::string twelve_shorts(bool big_endian = false) {
    return bytes_of(std::vector<int16_t>{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}, big_endian);
}

inline std::string nrrd_header(const std::string& more = "encoding: raw\nendian: little\n",
                               const std::string& type = "short") {
    return "NRRD0004\n# a comment\ntype: " + type +
           "\ndimension: 3\nspace: left-posterior-superior\nsizes: 3 2 2\n"
           "space directions: (2,0,0) (0,3,0) (0,0,4)\nkinds: domain domain domain\n"
           "space origin: (10,20,30)\n" +
           more;
}

inline std::string meta_image_header(const std::string& more,
                                     const std::string& data_file = "LOCAL") {
    return "ObjectType = Image\nNDims = 3\nDimSize = 3 2 2\nElementType = MET_SHORT\n"
           "ElementSpacing = 2 3 4\nOffset = 10 20 30\n"
           "ElementByteOrderMSB = False\n" +
           more + "ElementDataFile = " + data_file + "\n";
}

// The fields of an MGH file: 3 x 2 x 2 voxels at 2, 3 and 4 mm, oblique on request.
struct MghFields {
    int32_t type = 4, version = 1, frames = 1;
    bool has_geometry = true;
    std::vector<int32_t> size{3, 2, 2};
    std::vector<float> spacing{2, 3, 4};
    std::vector<float> directions{-1, 0, 0, 0, 0, -1, 0, 1, 0}; // RAS of x, then y, then z
    std::vector<float> center{10, 20, 30};                      // RAS
};

// Voxels count from 1 on, in the type; a footer of scan parameters follows.
inline std::string mgh(const MghFields& fields = {}) {
    std::string bytes = bytes_of(fields.version, true) + bytes_of(fields.size, true) +
                        bytes_of(fields.frames, true) + bytes_of(fields.type, true) +
                        bytes_of(int32_t{0}, true) + // degrees of freedom
                        bytes_of(static_cast<int16_t>(fields.has_geometry ? 1 : 0), true) +
                        bytes_of(fields.spacing, true) + bytes_of(fields.directions, true) +
                        bytes_of(fields.center, true);
    bytes.resize(284, '\0');
    int64_t count = fields.frames;
    for (const int32_t n : fields.size)
        count *= n;
    for (int64_t i = 1; i <= count; ++i)
        switch (fields.type) {
            case 0:
                bytes += bytes_of(static_cast<uint8_t>(i));
                break;
            case 1:
                bytes += bytes_of(static_cast<int32_t>(-100000 * i), true);
                break;
            case 3:
                bytes += bytes_of(0.5f * static_cast<float>(i), true);
                break;
            default:
                bytes += bytes_of(static_cast<int16_t>(i), true);
        }
    return bytes + bytes_of(std::vector<float>{2300, 0.1f, 2.9f, 900, 256}, true) + "tags";
}

// The members of a tar archive (POSIX ustar), with the two empty blocks at its end.
inline std::string tar(const std::vector<std::pair<std::string, std::string>>& members) {
    std::string archive;
    for (const auto& [name, content] : members) {
        std::string header(512, '\0');
        header.replace(0, name.size(), name);
        header.replace(100, 7, "0000644");
        char size[13];
        std::snprintf(size, sizeof size, "%011zo", content.size());
        header.replace(124, 11, size);
        header.replace(136, 11, "00000000000");
        header.replace(148, 8, "        ");
        header[156] = '0';
        header.replace(257, 8, std::string("ustar\00000", 8));
        unsigned sum = 0;
        for (const char c : header)
            sum += static_cast<unsigned char>(c);
        char checksum[8];
        std::snprintf(checksum, sizeof checksum, "%06o", sum);
        header.replace(148, 7, std::string(checksum, 7));
        archive += header + content + std::string((512 - content.size() % 512) % 512, '\0');
    }
    return archive + std::string(1024, '\0');
}

inline std::string project_plist(
    const std::string& matrix_file = "matrix.dat",
    const std::string& shape = "<integer>2</integer><integer>2</integer><integer>3</integer>",
    const std::string& dtype = "int16") {
    return R"(<?xml version="1.0" encoding="UTF-8"?>
<!DOCTYPE plist PUBLIC "-//Apple Computer//DTD PLIST 1.0//EN" "http://www.apple.com/DTDs/PropertyList-1.0.dtd">
<plist version="1.0"><dict>
<key>matrix</key><dict><key>dtype</key><string>)" +
           dtype + "</string><key>filename</key><string>" + matrix_file +
           "</string><key>shape</key><array>" + shape +
           R"(</array></dict>
<key>modality</key><string>CT</string><key>orientation</key><integer>1</integer>
<key>spacing</key><array><real>2</real><real>3</real><real>4</real></array>
</dict></plist>
)";
}

inline std::string project(const std::string& plist = project_plist()) {
    return tar({{"tmp/main.plist", plist}, {"tmp/matrix.dat", twelve_shorts()}});
}

} // namespace palpate::io
