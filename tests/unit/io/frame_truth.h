#pragma once

#include <zlib.h>

#include <algorithm>
#include <random>

#include "tests/unit/io/dicom_bytes.h"
#include "tests/unit/io_formats/decode_here.h"

// DICOM files of several frames, made at random from a known answer.
namespace palpate::test {

using Random = std::mt19937;

// Numbers as decimal strings, which hold 16 characters each.
inline std::string decimal_string(const std::vector<double>& values) {
    std::string text;
    for (const double value : values)
        text += (text.empty() ? "" : "\\") + fmt::format("{:.9g}", value);
    return text;
}

// A volume in time: `times` frames of `slices` slices, with slice k at origin + k * step * normal.
struct Truth {
    uint16_t columns = 5, rows = 3, slices = 4, times = 1;
    glm::dvec3 origin{}, across{1, 0, 0}, down{0, 1, 0};
    glm::dvec2 spacing{1};
    double step = 1; // negative: against the normal

    static int value(int x, int y, int slice, int time) {
        return x + 10 * y + 100 * slice + 2000 * time;
    }
    std::vector<double> place(int slice) const {
        const glm::dvec3 at = origin + slice * step * glm::cross(across, down);
        return {at.x, at.y, at.z};
    }
    std::vector<double> axes() const {
        return {across.x, across.y, across.z, down.x, down.y, down.z};
    }
};

inline double between(Random& random, double low, double high) {
    return low + (high - low) * static_cast<double>(random() % 10001) / 10000;
}

inline Truth random_truth(Random& random, bool in_time) {
    Truth truth;
    truth.columns = static_cast<uint16_t>(3 + random() % 4);
    truth.rows = static_cast<uint16_t>(2 + random() % 4);
    truth.slices = static_cast<uint16_t>(2 + random() % 6);
    truth.times = static_cast<uint16_t>(in_time ? 2 + random() % 4 : 1);
    for (int i = 0; i < 3; ++i)
        truth.origin[i] = between(random, -200, 200);
    const glm::dvec3 a(between(random, -1, 1), between(random, -1, 1), 1.5);
    truth.across = glm::normalize(a);
    truth.down =
        glm::normalize(glm::cross(truth.across, glm::dvec3(between(random, 0.5, 1), 0, 0)));
    truth.spacing = {between(random, 0.3, 4), between(random, 0.3, 4)};
    truth.step = between(random, 0.3, 6) * (random() % 2 == 0 ? 1 : -1);
    return truth;
}

// The frames of a file in some order: each a slice and a time, both from 0.
struct Stored {
    int slice = 0, time = 0;
};

inline std::vector<Stored> stored_frames(Random& random, const Truth& truth, bool shuffled) {
    std::vector<Stored> frames;
    for (int time = 0; time < truth.times; ++time)
        for (int slice = 0; slice < truth.slices; ++slice)
            frames.push_back({slice, time});
    for (size_t i = frames.size() - 1; shuffled && i > 0; --i)
        std::swap(frames[i], frames[random() % (i + 1)]);
    return frames;
}

// An image of several frames without a word about where they lie.
inline DicomData image_of(const Truth& truth, const std::vector<Stored>& frames) {
    DicomData data = test::samples(truth.columns, truth.rows, 16, 16, false);
    data.put(0x20, 0x0e, "UI", "1.2").put(0x20, 0x13, "IS", "1");
    if (frames.size() > 1)
        data.put(0x28, 8, "IS", std::to_string(frames.size()));
    std::vector<int> values;
    for (const Stored& frame : frames)
        for (int y = 0; y < truth.rows; ++y)
            for (int x = 0; x < truth.columns; ++x)
                values.push_back(Truth::value(x, y, frame.slice, frame.time));
    return data.put(0x7fe0, 0x10, "OW", test::words_16(values));
}

inline void put_spacing(const Truth& truth, DicomData& data) {
    data.put(0x28, 0x30, "DS", decimal_string({truth.spacing.y, truth.spacing.x}));
}

inline Result<io::DecodedHere> decoded(const std::filesystem::path& path,
                                       std::optional<uint32_t> frame = {}) {
    return io::decode_here(path, frame);
}

// Every sample must lie where the truth has it.
inline void expect_truth(const std::filesystem::path& path, const Truth& truth) {
    for (uint32_t time = 0; time < truth.times; ++time) {
        const auto found = decoded(path, truth.times > 1 ? std::optional(time) : std::nullopt);
        ASSERT_TRUE(found) << found.error().message;
        const Grid& grid = found->decoded.grid;
        ASSERT_EQ(grid.size, glm::uvec3(truth.columns, truth.rows, truth.slices));
        const glm::dmat4 index_from_world = glm::inverse(grid.world_from_index);
        for (int slice = 0; slice < truth.slices; ++slice)
            for (int y = 0; y < truth.rows; ++y)
                for (int x = 0; x < truth.columns; ++x) {
                    const glm::dvec3 world =
                        truth.origin + truth.across * (x * truth.spacing.x) +
                        truth.down * (y * truth.spacing.y) +
                        glm::cross(truth.across, truth.down) * (slice * truth.step);
                    const glm::dvec3 at(index_from_world * glm::dvec4(world, 1));
                    const glm::dvec3 nearest = glm::round(at);
                    // Nine digits of 200 mm and of unit vectors, at spacings from 0.3 mm.
                    ASSERT_LT(glm::distance(at, nearest), 1e-5);
                    const auto i = glm::uvec3(nearest);
                    ASSERT_LT(i.z, grid.size.z);
                    EXPECT_EQ(found->values[(i.z * grid.size.y + i.y) * grid.size.x + i.x],
                              Truth::value(x, y, slice, static_cast<int>(time)));
                }
    }
}

// An explicit file with its data set deflated (PS3.5 A.5); as it is where it states another syntax.
inline std::string deflated_file(std::string file) {
    const std::string plain = kExplicitLittle;
    const size_t uid = file.find(plain + '\0');
    const size_t end = uid + plain.size() + 1;
    if (uid == std::string::npos)
        return file; // damaged
    std::string packed(compressBound(file.size() - end) + 64, '\0');
    z_stream stream{};
    deflateInit2(&stream, 9, Z_DEFLATED, -15, 9, Z_DEFAULT_STRATEGY);
    stream.next_in = reinterpret_cast<Bytef*>(file.data() + end);
    stream.avail_in = static_cast<uInt>(file.size() - end);
    stream.next_out = reinterpret_cast<Bytef*>(packed.data());
    stream.avail_out = static_cast<uInt>(packed.size());
    EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
    packed.resize(stream.total_out + stream.total_out % 2);
    deflateEnd(&stream);
    // The syntax is the last element of the meta header, whose length grows by what its UID does.
    const std::string syntax = plain + ".99";
    const auto meta = static_cast<size_t>(static_cast<unsigned char>(file[140])) + 2;
    file[140] = static_cast<char>(meta);
    file[uid - 2] = static_cast<char>(syntax.size());
    return file.substr(0, uid) + syntax + packed;
}

// The encodings of every_encoding(), and deflated ones.
inline auto every_encoding_and_deflated() {
    return testing::Values(Encoding{false, false}, Encoding{false, true}, Encoding{true, false},
                           Encoding{true, true}, Encoding{false, false, false, true},
                           Encoding{false, true, false, true});
}

// Tests of files that hold a truth, in each encoding.
class FramesInFiles : public InEveryEncoding {
 protected:
    void write(const DicomData& data, const char* class_uid, const std::string& name = "a.dcm") {
        test::write(folder_ / name, file_of(data, class_uid, "1.2.3." + name));
    }
    static std::string file_of(const DicomData& data, const char* class_uid,
                               const std::string& uid) {
        const std::string file = data.file(class_uid, uid);
        return default_encoding.deflated ? deflated_file(file) : file;
    }
    std::string error_of(const DicomData& data, const char* class_uid) {
        write(data, class_uid);
        const auto found = decoded(folder_ / "a.dcm");
        return found ? "read" : found.error().message;
    }
    Folder folder_{"frames"};
};

} // namespace palpate::test
