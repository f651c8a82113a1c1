// NIfTI in two files: a header, .hdr, and its voxels, .img.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/io_formats/decode_here.h"
#include "tests/unit/io_formats/sample_files.h"

namespace palpate::io {
namespace {

using testing::HasSubstr;

TEST(NiftiPairs, AreReadFromEitherFile) {
    const TemporaryFolder folder;
    for (const int version : {1, 2}) {
        NiftiBytes header(version);
        version == 1 ? header.put<char>(345, 'i') : header.put<char>(5, 'i');
        folder.write("pair.hdr", header.vox_offset(0).with(""));
        folder.write("pair.img", twelve_shorts());
        for (const char* name : {"pair.hdr", "pair.img"}) {
            const auto result = decode_here(folder.path() / name);
            ASSERT_TRUE(result) << result.error().message;
            EXPECT_EQ(result->values, kOneToTwelve);
        }
        std::filesystem::remove(folder.path() / "pair.img");
        folder.write("pair.img.gz", deflated(twelve_shorts()));
        EXPECT_EQ(decode_here(folder.path() / "pair.hdr")->values, kOneToTwelve);
        std::filesystem::remove(folder.path() / "pair.img.gz");
        EXPECT_THAT(decode_here(folder.path() / "pair.hdr").error().message, HasSubstr("pair.img"));
    }
}

// Each file of a pair is packed or not, and named in small letters or capitals, by itself; FSL
// packs both. Either file names the pair.
TEST(NiftiPairs, MayBePackedAndNamedInCapitals) {
    for (const int version : {1, 2})
        for (const bool big_endian : {false, true})
            for (const char* hdr : {".hdr", ".hdr.gz", ".HDR", ".HDR.GZ"})
                for (const char* img : {".img", ".img.gz", ".IMG", ".IMG.GZ"}) {
                    SCOPED_TRACE(std::string(hdr) + " " + img);
                    const TemporaryFolder folder;
                    NiftiBytes header(version, big_endian);
                    header.put<char>(version == 1 ? 345 : 5, 'i');
                    const auto write = [&](const std::string& extension, const std::string& bytes) {
                        return folder.write("p.q" + extension,
                                            extension.size() > 4 ? deflated(bytes) : bytes);
                    };
                    for (const auto& path : {write(hdr, header.vox_offset(0).with("")),
                                             write(img, twelve_shorts(big_endian))}) {
                        const auto result = decode_here(path);
                        ASSERT_TRUE(result) << result.error().message;
                        EXPECT_EQ(result->values, kOneToTwelve);
                    }
                }
}

// Two files could be the other one: the one that is packed alike is taken.
TEST(NiftiPairs, OfOneNameBelongTogetherAsTheyArePacked) {
    const TemporaryFolder folder;
    NiftiBytes header(1);
    header.put<char>(345, 'i').vox_offset(0);
    std::vector<int16_t> others(12, 99);
    folder.write("v.hdr", header.with(""));
    folder.write("v.hdr.gz", deflated(header.with("")));
    folder.write("v.img", twelve_shorts());
    folder.write("v.img.gz", deflated(bytes_of(others)));
    for (const char* name : {"v.hdr", "v.img"})
        EXPECT_EQ(decode_here(folder.path() / name)->values, kOneToTwelve);
    for (const char* name : {"v.hdr.gz", "v.img.gz"})
        EXPECT_EQ(decode_here(folder.path() / name)->values, std::vector<double>(12, 99.0));
    std::filesystem::remove(folder.path() / "v.hdr");
    std::filesystem::remove(folder.path() / "v.hdr.gz");
    EXPECT_THAT(decode_here(folder.path() / "v.img.gz").error().message, HasSubstr("v.hdr.gz"));
}

} // namespace
} // namespace palpate::io
