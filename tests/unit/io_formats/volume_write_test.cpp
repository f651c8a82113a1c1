#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>

#include "engine/io/volume_io.h"
#include "engine/volume/builder.h"
#include "tests/unit/io_formats/decode_here.h"
#include "tests/unit/io_formats/sample_files.h"

namespace palpate::io {
namespace {

using testing::HasSubstr;

constexpr glm::uvec3 kSize(37, 9, 5); // rows cross a brick
constexpr ScalarType kTypes[] = {ScalarType::u8, ScalarType::i8, ScalarType::u16, ScalarType::i16,
                                 ScalarType::f32};

Grid upright() {
    return make_grid(kSize, {0.957031, 0.957031, 1.5}, {-120.25, 33.125, 1000.1});
}

// Columns in exact decimals of a turned, mirrored grid at right angles.
Grid oblique() {
    Grid grid;
    grid.size = kSize;
    grid.world_from_index = glm::dmat4(glm::dvec4(0.6, 0.8, 0, 0), glm::dvec4(-1.6, 1.2, 0, 0),
                                       glm::dvec4(0, 0, -3, 0), glm::dvec4(10, -20, 30.5, 1));
    return grid;
}

Grid sheared() {
    Grid grid = oblique();
    grid.world_from_index[2] = glm::dvec4(0.5, 0, -3, 0);
    return grid;
}

// Values over the whole range of the type; NaN here and there in f32.
double sample(ScalarType type, glm::uvec3 i) {
    const int h = static_cast<int>((i.x * 73u + i.y * 1021u + i.z * 4999u) % 256u); // 0 .. 255
    switch (type) {
        case ScalarType::u8:
            return h;
        case ScalarType::i8:
            return h - 128;
        case ScalarType::u16:
            return h * 257;
        case ScalarType::i16:
            return h * 257 - 32768;
        case ScalarType::f32:
            break;
    }
    return h == 7 ? std::nan("") : h * 0.1 - 5;
}

Volume sample_volume(const Grid& grid, ScalarType type) {
    return make_volume(grid, type, [type](glm::uvec3 i) { return sample(type, i); });
}

double farthest_corner_mm(const Grid& a, const Grid& b) {
    double most = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 pick(corner & 1, corner >> 1 & 1, corner >> 2);
        const glm::dvec3 index = pick * (glm::dvec3(a.size) - 1.0);
        most = std::max(most, glm::length(world_point(a, index) - world_point(b, index)));
    }
    return most;
}

class VolumeWrite : public testing::Test {
 protected:
    // Writes the volume, reads it back and compares every sample.
    Grid round_trip(const std::string& name, const Volume& volume) const {
        const auto path = folder_.path() / name;
        const Result<void> saved = save_volume(path, volume);
        EXPECT_TRUE(saved) << saved.error().message;
        const auto read = decode_here(path);
        EXPECT_TRUE(read) << read.error().message;
        if (!read)
            return {};
        EXPECT_STREQ(name_of(read->claim.type), name_of(volume.type()));
        EXPECT_THAT(read->decoded.warnings, testing::IsEmpty());
        EXPECT_THAT(read->decoded.rescale, testing::IsEmpty());
        const glm::uvec3 size = volume.size();
        EXPECT_EQ(read->decoded.grid.size, size);
        size_t different = 0, at = 0;
        for (uint32_t z = 0; z < size.z; ++z)
            for (uint32_t y = 0; y < size.y; ++y)
                for (uint32_t x = 0; x < size.x; ++x, ++at) {
                    const float expected = volume.value({x, y, z});
                    const double found = read->values[at];
                    different += std::isnan(expected) ? !std::isnan(found) : found != expected;
                }
        EXPECT_EQ(different, 0u) << name;
        EXPECT_TRUE(only_file(name));
        return read->decoded.grid;
    }
    // Nothing else was left behind; a .mhd has its .raw.
    bool only_file(const std::string& name) const {
        size_t others = 0;
        for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
            others += entry.path().filename() != name && entry.path().extension() != ".raw";
        std::filesystem::remove(folder_.path() / name);
        return others == 0;
    }
    TemporaryFolder folder_;
};

TEST_F(VolumeWrite, EveryTypeComesBackFromEveryFormat) {
    for (const ScalarType type : kTypes)
        for (const char* name : {"v.nii", "v.nii.gz", "v.nrrd", "v.mha", "v.mhd", "V.NII"})
            round_trip(name, sample_volume(upright(), type));
}

TEST_F(VolumeWrite, TextFormatsKeepPositionsToTheLastBit) {
    for (const Grid& grid : {upright(), oblique(), sheared()})
        EXPECT_EQ(round_trip("v.nrrd", sample_volume(grid, ScalarType::u8)), grid);
    // MetaImage splits steps into direction and spacing: two roundings of each entry, and the
    // products of 36 steps of at most 3 mm.
    for (const Grid& grid : {upright(), oblique()})
        EXPECT_LE(
            farthest_corner_mm(round_trip("v.mha", sample_volume(grid, ScalarType::u8)), grid),
            36 * 3 * 4 * 2.3e-16 * 3);
}

TEST_F(VolumeWrite, NiftiKeepsPositionsToTheFloatsItStores) {
    for (const Grid& grid : {upright(), oblique(), sheared()}) {
        const Grid read = round_trip("v.nii", sample_volume(grid, ScalarType::u8));
        EXPECT_EQ(read.world_from_index, glm::dmat4(glm::mat4(grid.world_from_index)));
    }
}

// Byte 344 of version 1 is the magic; byte 4 of version 2.
TEST_F(VolumeWrite, NiftiVersion2IsUsedWhereVersion1CannotHoldTheGrid) {
    const Grid far = make_grid({4, 3, 2}, {0.25, 0.25, 0.3}, {1e6 + 0.1, 0, 0});
    EXPECT_EQ(round_trip("v.nii", sample_volume(far, ScalarType::i16)), far);
    const Grid lengthy = make_grid({40000, 1, 1}, {0.1, 1, 1});
    EXPECT_EQ(round_trip("v.nii.gz", sample_volume(lengthy, ScalarType::u8)), lengthy);
    ASSERT_TRUE(save_volume(folder_.path() / "v.nii", sample_volume(upright(), ScalarType::u8)));
    EXPECT_EQ(read_bytes(folder_.path() / "v.nii").substr(344, 4), std::string("n+1\0", 4));
}

TEST_F(VolumeWrite, QformSaysTheSameAsTheSform) {
    for (const Grid& grid : {upright(), oblique()}) {
        const auto path = folder_.path() / "v.nii";
        ASSERT_TRUE(save_volume(path, sample_volume(grid, ScalarType::u8)));
        std::string bytes = read_bytes(path);
        bytes.replace(254, 2, 2, '\0'); // sform_code 0: the qform counts
        const auto read = decode_here(folder_.write("q.nii", bytes));
        ASSERT_TRUE(read);
        // Floats of the quaternion and spacing: 2^-24 each; an entry of the matrix is a sum of
        // four products of two (factor 8), times the spacing, over 36 + 8 + 4 steps of at most
        // 3 mm; the offset, up to 1000 mm, is rounded once.
        EXPECT_LE(farthest_corner_mm(read->decoded.grid, grid),
                  6e-8 * (9 * 3 * (36 + 8 + 4) + 1001));
    }
    const auto path = folder_.path() / "s.nii";
    ASSERT_TRUE(save_volume(path, sample_volume(sheared(), ScalarType::u8)));
    EXPECT_EQ(read_bytes(path).substr(252, 4), std::string("\0\0\1\0", 4)); // qform 0, sform 1
}

TEST_F(VolumeWrite, WhatAFormatCannotHoldIsRefusedByName) {
    const auto refusal = [&](const std::string& name, const Grid& grid) {
        const Result<void> saved =
            save_volume(folder_.path() / name, sample_volume(grid, ScalarType::u8));
        EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
        return saved ? "not refused" : saved.error().message;
    };
    EXPECT_THAT(refusal("v.mha", sheared()), HasSubstr("right angles"));
    EXPECT_THAT(refusal("v.mhd", sheared()), HasSubstr("right angles"));
    EXPECT_THAT(refusal("v.vtk", oblique()), HasSubstr("legacy VTK"));
    EXPECT_THAT(refusal("v.vtk", make_grid(kSize, {-1, 1, 1})), HasSubstr("legacy VTK"));
    EXPECT_THAT(refusal("v.xyz", upright()), HasSubstr(".nii.gz"));
    EXPECT_THAT(refusal("missing_folder/v.nii", upright()), HasSubstr("No such file"));
}

TEST_F(VolumeWrite, VtkHoldsBigEndianNumbersAfterItsHeader) {
    for (const ScalarType type : kTypes) {
        const Volume volume = sample_volume(upright(), type);
        ASSERT_TRUE(save_volume(folder_.path() / "v.vtk", volume));
        const std::string bytes = read_bytes(folder_.path() / "v.vtk");
        EXPECT_THAT(bytes, HasSubstr("DIMENSIONS 37 9 5\nORIGIN -120.25 33.125 1000.1\n"
                                     "SPACING 0.957031 0.957031 1.5\nPOINT_DATA 1665\n"));
        visit_scalar(type, [&](auto t) {
            using T = decltype(t);
            std::vector<T> expected;
            for (uint32_t z = 0; z < kSize.z; ++z)
                for (uint32_t y = 0; y < kSize.y; ++y)
                    for (uint32_t x = 0; x < kSize.x; ++x)
                        expected.push_back(static_cast<T>(volume.value({x, y, z})));
            EXPECT_TRUE(bytes.ends_with("LOOKUP_TABLE default\n" + bytes_of(expected, true)));
        });
    }
}

TEST_F(VolumeWrite, VtkComesBackByItsOwnReader) {
    for (const ScalarType type : kTypes) {
        const Volume volume = sample_volume(upright(), type);
        ASSERT_TRUE(save_volume(folder_.path() / "v.vtk", volume));
        const auto read = decode_here(folder_.path() / "v.vtk");
        ASSERT_TRUE(read) << read.error().message;
        EXPECT_STREQ(name_of(read->claim.type), name_of(type));
        EXPECT_EQ(read->decoded.grid, upright());
        for (size_t i = 0; i < read->values.size(); ++i) {
            const float expected = volume.value({i % 37, i / 37 % 9, i / (37 * 9)});
            ASSERT_TRUE(read->values[i] == expected || std::isnan(expected)) << i;
        }
    }
}

TEST_F(VolumeWrite, TwoRunsGiveTheSameBytes) {
    const Volume volume = sample_volume(oblique(), ScalarType::i16);
    for (const std::string extension : {".nii.gz", ".nrrd", ".mha"}) {
        ASSERT_TRUE(save_volume(folder_.path() / ("a" + extension), volume));
        ASSERT_TRUE(save_volume(folder_.path() / ("b" + extension), volume));
        EXPECT_EQ(read_bytes(folder_.path() / ("a" + extension)),
                  read_bytes(folder_.path() / ("b" + extension)));
    }
}

TEST_F(VolumeWrite, StoppedWritingLeavesWhatWasThere) {
    std::stop_source stop;
    stop.request_stop();
    const Volume volume = sample_volume(upright(), ScalarType::u8);
    for (const char* name : {"v.nii", "v.mhd"}) {
        folder_.write(name, "before");
        const Result<void> saved = save_volume(folder_.path() / name, volume, stop.get_token());
        ASSERT_FALSE(saved);
        EXPECT_THAT(saved.error().message, HasSubstr("stopped"));
        EXPECT_EQ(read_bytes(folder_.path() / name), "before");
        EXPECT_TRUE(only_file(name));
    }
}

// Files of this process may not grow beyond a limit; stands in for a full disk.
class FileLimit {
 public:
    explicit FileLimit(rlim_t bytes) {
        before_ = std::signal(SIGXFSZ, SIG_IGN);
        ::getrlimit(RLIMIT_FSIZE, &limit_);
        const rlimit smaller{bytes, limit_.rlim_max};
        ::setrlimit(RLIMIT_FSIZE, &smaller);
    }
    ~FileLimit() {
        ::setrlimit(RLIMIT_FSIZE, &limit_);
        std::signal(SIGXFSZ, before_);
    }

 private:
    rlimit limit_{};
    void (*before_)(int);
};

TEST_F(VolumeWrite, FullDiskIsOneSentenceAndLeavesWhatWasThere) {
    const Volume volume = sample_volume(upright(), ScalarType::i16); // 3330 bytes
    for (const char* name : {"v.nii", "v.nii.gz", "v.nrrd", "v.mha", "v.mhd", "v.vtk"}) {
        folder_.write(name, "before");
        Result<void> saved;
        {
            const FileLimit limit(700);
            saved = save_volume(folder_.path() / name, volume);
        }
        ASSERT_FALSE(saved) << name;
        EXPECT_THAT(saved.error().message, HasSubstr("cannot be written"));
        EXPECT_EQ(saved.error().message.find('\n'), std::string::npos);
        EXPECT_EQ(read_bytes(folder_.path() / name), "before");
        EXPECT_TRUE(only_file(name));
        EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
    }
}

} // namespace
} // namespace palpate::io
