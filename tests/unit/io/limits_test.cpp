#include <gmock/gmock.h>
#include <sys/mman.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "engine/io/decoder.h"

namespace palpate::io {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

struct Memory {
    int fd = ::memfd_create("test", MFD_CLOEXEC);
    ~Memory() { ::close(fd); }
};

TEST(VoxelSink, GivesZeroedMemoryOfTheClaimedSize) {
    const Memory memory;
    VoxelSink sink(memory.fd, -1, 1 << 20);
    const auto voxels = sink.allocate(
        "f", {.size = {3, 5, 7}, .type = ComponentType::i16, .components = 2, .source_bytes = 420});
    ASSERT_TRUE(voxels) << voxels.error().message;
    EXPECT_EQ(voxels->size(), 3u * 5 * 7 * 2 * 2);
    EXPECT_EQ((*voxels)[419], std::byte{0});
}

TEST(VoxelSink, RefusesMoreThanTheSourceCanHold) {
    const Memory memory;
    VoxelSink sink(memory.fd, -1, 1 << 30);
    const auto raw = sink.allocate(
        "f", {.size = {10, 10, 10}, .type = ComponentType::f32, .source_bytes = 3999});
    ASSERT_FALSE(raw);
    EXPECT_THAT(raw.error().message, AllOf(HasSubstr("4000 bytes"), HasSubstr("3999")));
    const auto packed = sink.allocate("f", {.size = {1000, 1000, 10},
                                            .type = ComponentType::u8,
                                            .source_bytes = 9000,
                                            .most_expansion = kDeflateExpansion});
    ASSERT_FALSE(packed);
    EXPECT_THAT(packed.error().message, HasSubstr("9288000")); // 9000 * 1032
}

TEST(VoxelSink, CountsTheVolumeMadeFromTheVoxels) {
    const Memory memory;
    // 1000 voxels of f64 decode to 8000 bytes, and become a volume of 4000 as f32.
    const VoxelClaim claim{.size = {10, 10, 10}, .type = ComponentType::f64, .source_bytes = 8000};
    VoxelSink too_small(memory.fd, -1, 11999);
    const auto refused = too_small.allocate("f", claim);
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, AllOf(HasSubstr("12000"), HasSubstr("11999")));
    VoxelSink enough(memory.fd, -1, 12000);
    EXPECT_TRUE(enough.allocate("f", claim));
}

TEST(VoxelSink, RefusesSizesThatOverflowOrVanish) {
    EXPECT_FALSE(claimed_bytes({.size = {0, 1, 1}, .type = ComponentType::u8}));
    EXPECT_FALSE(claimed_bytes({.size = glm::uvec3(0xffffffff), .type = ComponentType::u8}));
    EXPECT_FALSE(claimed_bytes({.size = {1, 1, 1}, .type = ComponentType::u8, .components = 0}));
    EXPECT_EQ(claimed_bytes({.size = {1u << 20, 1u << 20, 1u << 19}, .type = ComponentType::f64}),
              uint64_t{1} << 62);
}

TEST(Frames, DefaultToTheFirstWithAWarning) {
    std::vector<std::string> warnings;
    EXPECT_EQ(choose_frame({"f"}, 1, warnings).value(), 0u);
    EXPECT_TRUE(warnings.empty());
    EXPECT_EQ(choose_frame({"f"}, 5, warnings).value(), 0u);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_THAT(warnings[0], HasSubstr("5 frames"));
    EXPECT_EQ(choose_frame({.path = "f", .frame = 4}, 5, warnings).value(), 4u);
    EXPECT_EQ(warnings.size(), 1u);
    EXPECT_THAT(choose_frame({.path = "f", .frame = 5}, 5, warnings).error().message,
                HasSubstr("no frame 5"));
}

TEST(FilesBeside, StayInTheFolderOfTheHeader) {
    const fs::path root = fs::path(::testing::TempDir()) / "palpate_beside";
    fs::remove_all(root);
    fs::create_directories(root / "in" / "deeper");
    for (const char* file : {"outside.raw", "in/header.mhd", "in/a.raw", "in/deeper/b.raw"})
        std::ofstream(root / file) << "x";
    fs::create_symlink(root / "outside.raw", root / "in" / "link.raw");
    fs::create_directories(root / "in2");
    std::ofstream(root / "in2" / "c.raw") << "x";
    const fs::path header = root / "in" / "header.mhd";
    EXPECT_TRUE(file_beside(header, "a.raw"));
    EXPECT_TRUE(file_beside(header, "deeper/b.raw"));
    EXPECT_TRUE(file_beside(header, "deeper/../a.raw"));
    EXPECT_TRUE(file_beside(header, (root / "in" / "a.raw").string()));
    for (const std::string name : {"../outside.raw", "/etc/passwd", "link.raw", "../in2/c.raw"})
        EXPECT_THAT(file_beside(header, name).error().message, HasSubstr("outside")) << name;
    EXPECT_THAT(file_beside(header, "none.raw").error().message, HasSubstr("none.raw"));
    EXPECT_THAT(file_beside(header, "deeper").error().message, HasSubstr("regular file"));
    fs::remove_all(root);
}

} // namespace
} // namespace palpate::io
