// Whenever the program is killed, its output is as it was before or as it is after, never between.

#include "tests/support/kill.h"
#include "engine/io/volume_io.h"
#include "engine/volume/synthetic.h"
#include "tests/support/program.h"

namespace palpate {
namespace {

// Killed takes over 5 s of a processor: the program is started and killed 130 times.
class Killed : public ProgramTest {
 protected:
    void save_phantom(const std::string& name, glm::uvec3 size) const {
        const Grid grid = make_grid(size, 200.0 / glm::dvec3(size), glm::dvec3(-100.0));
        ASSERT_TRUE(save_volume(file(name), synthetic::sample_ct_phantom(grid)));
    }

    // Runs the program with `arguments`, which writes `outputs`, and kills it `count` times: once
    // round with nothing there before, and once with `older` files in their place.
    void expect_whole_or_untouched(int count, const std::vector<std::string>& arguments,
                                   const std::vector<std::string>& outputs) {
        ASSERT_EQ(run(arguments).exit_code, 0) << bytes_of("stderr");
        std::vector<std::string> whole;
        for (const std::string& name : outputs) {
            ASSERT_FALSE(bytes_of(name).empty()) << name;
            whole.push_back(bytes_of(name));
        }
        for (const bool over_older : {false, true}) {
            const std::string older = "older";
            const auto prepare = [&] {
                for (const std::string& name : outputs) {
                    std::filesystem::remove(file(name));
                    if (over_older)
                        write(name, older);
                }
            };
            prepare();
            kill_at_many_moments(
                count, [&] { return become_program(arguments); },
                [&] {
                    for (size_t i = 0; i < outputs.size(); ++i) {
                        const bool is_there = std::filesystem::exists(file(outputs[i]));
                        const std::string found = bytes_of(outputs[i]);
                        ASSERT_TRUE(found == whole[i] || (over_older ? found == older : !is_there))
                            << outputs[i] << " is partial: " << found.size() << " bytes";
                    }
                    prepare();
                });
            if (HasFatalFailure())
                return;
        }
    }
};

TEST_F(Killed, ConvertLeavesNoPartialFile) {
    save_phantom("in.nrrd", glm::uvec3(96));
    for (const std::string name : {"out.nii.gz", "out.nrrd"})
        expect_whole_or_untouched(10, {"convert", file("in.nrrd").string(), file(name).string()},
                                  {name});
}

// Header and voxels are two files. Killed between them, the header may be missing, but none may
// name the voxels of another volume.
TEST_F(Killed, MetaImageHeaderNeverNamesOtherVoxels) {
    save_phantom("a.nrrd", {100, 90, 80});
    save_phantom("b.nrrd", {80, 90, 100});
    const auto convert = [&](const std::string& from) {
        return std::vector<std::string>{"convert", file(from).string(), file("out.mhd").string()};
    };
    ASSERT_EQ(run(convert("a.nrrd")).exit_code, 0) << bytes_of("stderr");
    const std::string header = bytes_of("out.mhd"), voxels = bytes_of("out.raw");
    ASSERT_EQ(run(convert("b.nrrd")).exit_code, 0); // as many bytes, which no reader can tell
    const std::string older_header = bytes_of("out.mhd"), older_voxels = bytes_of("out.raw");
    ASSERT_EQ(voxels.size(), older_voxels.size());
    kill_at_many_moments(
        30, [&] { return become_program(convert("a.nrrd")); },
        [&] {
            if (const std::string found = bytes_of("out.mhd"); !found.empty()) {
                ASSERT_TRUE(found == header || found == older_header);
                ASSERT_TRUE(bytes_of("out.raw") == (found == header ? voxels : older_voxels));
            }
            write("out.raw", older_voxels);
            write("out.mhd", older_header);
        });
}

TEST_F(Killed, RenderLeavesNoPartialPicture) {
    for (const std::string name : {"out.exr", "out.png"})
        expect_whole_or_untouched(
            10,
            {"render", "synthetic:phantom?size=32", "--size", "64,64", "-o", file(name).string()},
            {name});
}

// Two files, each whole or not there; killed between them, the left one alone is there.
TEST_F(Killed, RenderLeavesNoPartialEye) {
    expect_whole_or_untouched(10,
                              {"render", "synthetic:phantom?size=32", "--size", "64,64", "--stereo",
                               "separate", "-o", file("out.png").string()},
                              {"out_left.png", "out_right.png"});
}

} // namespace
} // namespace palpate
