#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/io_formats/decode_here.h"
#include "tests/unit/io_formats/sample_files.h"

// Every beginning of a valid file, byte by byte, must be refused with a sentence that names it.
namespace palpate::io {
namespace {

// `enough` is the least length that a reader cannot tell from a whole file; absent: the whole.
void expect_refusals(const std::string& name, const std::string& bytes,
                     std::optional<size_t> enough = {}) {
    const TemporaryFolder folder;
    const auto whole = decode_here(folder.write(name, bytes));
    ASSERT_TRUE(whole) << whole.error().message;
    for (size_t length = 0; length < enough.value_or(bytes.size()); ++length) {
        const auto path = folder.write(name, bytes.substr(0, length));
        const auto result = decode_here(path);
        ASSERT_FALSE(result) << name << " cut to " << length << " of " << bytes.size();
        EXPECT_THAT(result.error().message, testing::StartsWith(path.string() + ": "));
        EXPECT_EQ(result.error().message.find('\n'), std::string::npos);
    }
}

// Truncation takes over 5 s of a processor: files are cut after every byte, and each cut is read.
TEST(Truncation, Nifti) {
    for (const int version : {1, 2})
        for (const bool big_endian : {false, true}) {
            const std::string bytes =
                NiftiBytes(version, big_endian).with(twelve_shorts(big_endian));
            expect_refusals("v.nii", bytes);
            expect_refusals("v.nii.gz", deflated(bytes));
        }
}

TEST(Truncation, Nrrd) {
    expect_refusals("v.nrrd", nrrd_header() + "\n" + twelve_shorts());
    expect_refusals("v.nrrd", nrrd_header("encoding: gzip\nendian: little\n") + "\n" +
                                  deflated(twelve_shorts()));
    // Without its last digit the last number is another number.
    const std::string text = nrrd_header("encoding: ascii\n") + "\n1 2 3 4 5 6 7 8 9 10 11 12";
    expect_refusals("v.nrrd", text, text.size() - 1);
}

TEST(Truncation, MetaImage) {
    expect_refusals("v.mha", meta_image_header("") + twelve_shorts());
    expect_refusals("v.mha",
                    meta_image_header("CompressedData = True\n") + deflated(twelve_shorts(), 15));
}

TEST(Truncation, Mgh) {
    const std::string footed = mgh(), bytes = footed.substr(0, 284 + 24);
    expect_refusals("v.mgh", footed, bytes.size()); // what may follow the voxels may be missing
    expect_refusals("v.mgz", deflated(bytes));
}

TEST(Truncation, DetachedData) {
    for (const bool nrrd : {false, true}) {
        const TemporaryFolder folder;
        const auto header =
            folder.write(nrrd ? "v.nhdr" : "v.mhd",
                         nrrd ? nrrd_header("encoding: raw\nendian: little\ndata file: v.raw\n")
                              : meta_image_header("", "v.raw"));
        for (size_t length = 0; length < 24; ++length) {
            folder.write("v.raw", twelve_shorts().substr(0, length));
            const auto result = decode_here(header);
            ASSERT_FALSE(result);
            EXPECT_THAT(result.error().message,
                        testing::HasSubstr(fmt::format("{} bytes", length)));
        }
    }
}

TEST(Truncation, Invesalius) {
    // The two empty blocks that end an archive, and what fills up the last member, hold nothing.
    const std::string bytes = project();
    expect_refusals("p.inv3", bytes, bytes.size() - 1024 - (512 - 24));
    expect_refusals("p.inv3", deflated(bytes), deflated(bytes).size() - 8);
}

// Any one byte of a header may be anything: the outcome is a volume or a sentence, and a volume
// never claims more than the file can hold.
TEST(Damage, EveryByteOfEveryHeader) {
    const TemporaryFolder folder;
    const std::pair<std::string, std::string> files[] = {
        {"v.nii", NiftiBytes(1).with(twelve_shorts())},
        {"v.nii", NiftiBytes(2).with(twelve_shorts())},
        {"v.nrrd", nrrd_header() + "\n" + twelve_shorts()},
        {"v.mha", meta_image_header("") + twelve_shorts()},
        {"v.mgh", mgh()},
        {"p.inv3", project().substr(0, 2560)},
    };
    for (const auto& [name, bytes] : files)
        for (size_t at = 0; at < std::min<size_t>(bytes.size(), 1400); ++at)
            for (const char value : {'\0', '\x7f', '\xff', '9', '-', '('}) {
                std::string damaged = bytes;
                damaged[at] = value;
                const auto result = decode_here(folder.write(name, damaged));
                if (result)
                    EXPECT_LE(*claimed_bytes(result->claim), bytes.size() * 8);
                else
                    EXPECT_FALSE(result.error().message.empty());
            }
}

} // namespace
} // namespace palpate::io
