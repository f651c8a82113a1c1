#include <gmock/gmock.h>

#include "engine/io/volume_io.h"
#include "engine/volume/builder.h"
#include "tests/support/kill.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

using ::testing::HasSubstr;

class ConvertCommand : public ProgramTest {
 protected:
    ConvertCommand() {
        ramp_ = make_volume(make_grid({5, 4, 3}, {0.5, 1, 2}, {1, 2, 3}), ScalarType::i16,
                            [](glm::uvec3 i) { return -1000.0 + 90.0 * i.x + i.y + 7.0 * i.z; });
        EXPECT_TRUE(save_volume(file("ramp.nrrd"), *ramp_));
    }
    std::optional<Volume> ramp_;
};

TEST_F(ConvertCommand, KeepsEveryVoxelAndItsPlaceInEveryFormat) {
    std::string from = "ramp.nrrd";
    for (const std::string to : {"a.nii", "b.nii.gz", "c.mha", "d.mhd", "e.vtk", "f.nrrd"}) {
        const ProgramRun ran = run({"convert", file(from).string(), file(to).string()});
        ASSERT_EQ(ran.exit_code, 0) << ran.messages;
        EXPECT_EQ(ran.output, "");
        const Result<LoadedVolume> loaded = load_volume(file(to));
        ASSERT_TRUE(loaded) << loaded.error().message;
        EXPECT_EQ(loaded->volume.grid(), ramp_->grid()) << to; // exact in float, as NIfTI stores it
        EXPECT_EQ(loaded->volume.type(), ScalarType::i16);
        for (uint32_t z = 0; z < 3; ++z)
            for (uint32_t y = 0; y < 4; ++y)
                for (uint32_t x = 0; x < 5; ++x)
                    ASSERT_EQ(loaded->volume.value({x, y, z}), ramp_->value({x, y, z})) << to;
        from = to;
    }
}

TEST_F(ConvertCommand, LeavesNothingBehindWhenItFails) {
    write("out.nii", "old");
    EXPECT_EQ(run({"convert", file("absent.nii").string(), file("out.nii").string()}).exit_code, 1);
    EXPECT_EQ(bytes_of("out.nii"), "old");
    const ProgramRun unknown =
        run({"convert", file("ramp.nrrd").string(), file("out.xyz").string()});
    EXPECT_EQ(unknown.exit_code, 1);
    EXPECT_THAT(unknown.messages, HasSubstr("out.xyz"));
    const ProgramRun nowhere =
        run({"convert", file("ramp.nrrd").string(), file("none/out.nii").string()});
    EXPECT_EQ(nowhere.exit_code, 1);
    EXPECT_THAT(nowhere.messages, HasSubstr("none/out.nii"));
    size_t files = 0;
    for ([[maybe_unused]] const auto& entry :
         std::filesystem::directory_iterator(file("ramp.nrrd").parent_path()))
        ++files;
    EXPECT_EQ(files, 4u); // ramp.nrrd, out.nii, and what run() keeps of the last run
    EXPECT_EQ(run({"convert", file("ramp.nrrd").string()}).exit_code, 2);
}

// Interrupted at any moment, the output is whole or absent, and no other file is left.
TEST_F(ConvertCommand, InterruptedLeavesAWholeFileOrNone) {
    const Volume noise =
        make_volume(make_grid({160, 160, 160}, {1, 1, 1}), ScalarType::u16, [](glm::uvec3 i) {
            return (i.x * 73856093u ^ i.y * 19349663u ^ i.z * 83492791u) % 65536u;
        });
    ASSERT_TRUE(save_volume(file("noise.nrrd"), noise));
    const std::string in = file("noise.nrrd").string(), out = file("out.nii.gz").string();
    interrupt_at_many_moments(
        3,
        [&] {
            return become_program({"convert", in, out});
        },
        [&](bool is_done) {
            EXPECT_TRUE(!is_done || std::filesystem::exists(out));
            if (std::filesystem::exists(out)) { // ended between the file and its last word, too
                const Result<LoadedVolume> whole = load_volume(out);
                EXPECT_TRUE(whole) << whole.error().message;
            }
            for (const auto& entry : std::filesystem::directory_iterator(file("").parent_path()))
                EXPECT_EQ(entry.path().filename().string().find(".tmp"), std::string::npos)
                    << entry.path();
            std::filesystem::remove(out);
        });
}

} // namespace
} // namespace palpate
