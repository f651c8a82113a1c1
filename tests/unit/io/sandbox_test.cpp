#include "engine/io/sandbox.h"

#include <gmock/gmock.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "engine/io/volume_io.h"
#include "tests/support/paths.h"
#include "tests/unit/io/dicom_bytes.h"

namespace palpate {
namespace {

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

// Loads with the decoder that misbehaves as the name of the file says.
class Sandbox : public ::testing::Test {
 protected:
    void SetUp() override { ::setenv("PALPATE_DECODER", MISBEHAVING_DECODER, 1); }
    void TearDown() override { ::unsetenv("PALPATE_DECODER"); }

    static std::string error_of(const char* what, const ReadOptions& options = {}) {
        const Result<LoadedVolume> loaded = load_volume(what, options);
        EXPECT_FALSE(loaded.has_value()) << what;
        return loaded ? "" : loaded.error().message;
    }
};

// No child of this process is left, running or dead.
bool has_no_children() {
    return ::waitpid(-1, nullptr, WNOHANG) == -1 && errno == ECHILD;
}

TEST_F(Sandbox, AWellBehavedChildGivesItsVoxels) {
    const Result<LoadedVolume> loaded = load_volume("well");
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_EQ(loaded->volume.size(), glm::uvec3(2));
    EXPECT_EQ(loaded->volume.value({1, 1, 1}), 7.0f);
    EXPECT_TRUE(has_no_children());
}

TEST_F(Sandbox, ACrashIsOneSentenceNamingTheFile) {
    EXPECT_THAT(error_of("segfault"), AllOf(StartsWith("segfault: the header is damaged"),
                                            HasSubstr("crashed (signal 11"), Not(HasSubstr("\n"))));
    EXPECT_THAT(error_of("abort"),
                AllOf(StartsWith("abort: the header is damaged"), EndsWith("its reader gave up")));
    EXPECT_THAT(error_of("terminate"), EndsWith("its reader gave up"));
    EXPECT_THAT(error_of("exit"), HasSubstr("exit status 3"));
    EXPECT_THAT(error_of("throw"), AllOf(StartsWith("throw: "), HasSubstr("thrown by a reader")));
    EXPECT_THAT(error_of("crash_after_claim"), AllOf(HasSubstr("the voxels are damaged"),
                                                     HasSubstr("while it read slice_17.dcm")));
    EXPECT_TRUE(has_no_children());
}

// A folder of DICOM files in some of which the codec dies: the others are read.
TEST_F(Sandbox, AFileInWhichTheReaderDiesIsPassedOver) {
    for (const std::string what : {"aborts", "crashes", "hangs"}) {
        const test::Folder folder("dies");
        std::filesystem::create_directories(folder / "below");
        const auto dies = [](uint32_t z) { return z == 3 || z == 8; };
        for (uint32_t z = 0; z < 12; ++z)
            test::write(folder / fmt::format("below/{}{}.dcm", dies(z) ? what : "s", z),
                        test::dicom_slice(static_cast<int>(z)));
        const Result<LoadedVolume> loaded = load_volume(folder.path(), {.max_quiet_s = 0.5});
        ASSERT_TRUE(loaded) << loaded.error().message;
        ASSERT_EQ(loaded->volume.size(), glm::uvec3(8, 4, 12));
        const std::vector<std::string>& warnings = loaded->warnings;
        for (uint32_t z = 0; z < 12; ++z) {
            const bool died = dies(z);
            EXPECT_EQ(std::isnan(loaded->volume.value({3, 2, z})), died) << z;
            const std::string words = fmt::format(
                "below/{}{}.dcm: is passed over: the reader "
                "crashed or got nowhere in it",
                what, z);
            EXPECT_EQ(std::count_if(warnings.begin(), warnings.end(),
                                    [&](const std::string& w) { return w.ends_with(words); }),
                      died)
                << words;
        }
        EXPECT_TRUE(has_no_children());
        // Alone it is refused, and so is a folder of many: after nine readers.
        EXPECT_THAT(
            error_of((folder / fmt::format("below/{}3.dcm", what)).c_str(), {.max_quiet_s = 0.2}),
            HasSubstr("below/" + what + "3.dcm: "));
    }
    const test::Folder all("all_die");
    for (int z = 0; z < 12; ++z)
        test::write(all / fmt::format("aborts{:02}", z), test::dicom_slice(z));
    EXPECT_THAT(error_of(all.path().c_str()),
                AllOf(HasSubstr("its reader gave up"), EndsWith("while it read aborts08")));
}

TEST_F(Sandbox, AHangIsStoppedWithinTwoSeconds) {
    ReadOptions options;
    options.max_quiet_s = 0.2;
    EXPECT_THAT(error_of("spin", options), HasSubstr("got nowhere in 0.2 s"));
    EXPECT_THAT(error_of("sleep", options), HasSubstr("got nowhere")); // ten times the wall clock
    EXPECT_LE(ReadOptions().max_quiet_s, 2.0);
    EXPECT_TRUE(has_no_children());
}

TEST_F(Sandbox, MemoryBeyondTheHeaderIsRefused) {
#if defined(__SANITIZE_ADDRESS__)
    GTEST_SKIP() << "the address sanitizer maps more than any limit";
#endif
    EXPECT_THAT(error_of("greedy"),
                AllOf(StartsWith("greedy: "), HasSubstr("more memory than its size justifies")));
    rusage children{};
    ::getrusage(RUSAGE_CHILDREN, &children);
    EXPECT_LE(children.ru_maxrss, 512 << 10); // KiB, the largest of all children so far
}

TEST_F(Sandbox, AClaimBeyondTheLimitIsRefusedWithBothNumbers) {
    ReadOptions options;
    options.max_memory_bytes = 123456789;
    EXPECT_THAT(error_of("claim_too_large", options),
                AllOf(HasSubstr("100000 x 100000 x 100000"), HasSubstr("12000000000000000"),
                      HasSubstr("123456789")));
}

TEST_F(Sandbox, ALyingChildIsNotBelieved) {
    EXPECT_THAT(error_of("no_claim"), HasSubstr("makes no sense"));
    EXPECT_THAT(error_of("shrinks"), HasSubstr("left 0 bytes"));
    EXPECT_THAT(error_of("other_size"), HasSubstr("size changed"));
    EXPECT_THAT(error_of("flat"), HasSubstr("span no space"));
    EXPECT_THAT(error_of("not_finite"), HasSubstr("not finite"));
    EXPECT_THAT(error_of("babble"), HasSubstr("makes no sense"));
    EXPECT_THAT(error_of("flood"), HasSubstr("said too much"));
    EXPECT_TRUE(has_no_children());
}

TEST_F(Sandbox, StopEndsTheChild) {
    std::stop_source source;
    ReadOptions options;
    options.stop = source.get_token();
    source.request_stop();
    EXPECT_THAT(error_of("spin", options), HasSubstr("interrupted"));
    EXPECT_TRUE(has_no_children());
}

TEST_F(Sandbox, TheChildDiesWithItsParent) {
    const pid_t parent = ::fork();
    if (parent == 0) { // becomes a parent that is killed while its child spins
        ReadOptions options;
        options.max_quiet_s = 60;
        (void)load_volume("spin", options);
        ::_exit(0);
    }
    // Wait for the grandchild to appear, then kill its parent.
    const std::string list =
        "/proc/" + std::to_string(parent) + "/task/" + std::to_string(parent) + "/children";
    pid_t child = 0;
    while (child == 0)
        std::ifstream(list) >> child;
    ::kill(parent, SIGKILL);
    ::waitpid(parent, nullptr, 0);
    const auto runs = [&] {
        std::ifstream stat("/proc/" + std::to_string(child) + "/stat");
        std::string id, name, state;
        stat >> id >> name >> state;
        return stat && state != "Z" && state != "X"; // a zombie is its new parent's to reap
    };
    while (runs()) // without end where it outlives its parent: ctest then ends both
        std::this_thread::yield();
}

TEST_F(Sandbox, AMissingDecoderIsSaid) {
    ::setenv("PALPATE_DECODER", "/nowhere/palpate", 1);
    EXPECT_THAT(error_of("x.nii"), AllOf(HasSubstr("x.nii"), HasSubstr("/nowhere/palpate")));
}

TEST(DecoderProgram, IsPalpateBesideTheTests) {
    EXPECT_EQ(io::decoder_program(), kProgram);
}

TEST_F(Sandbox, TheDecoderThatAProgramSetsIsTheOneThatIsStarted) {
    io::set_decoder_program("/elsewhere/palpate");
    EXPECT_THAT(error_of("x.nii"), AllOf(HasSubstr("x.nii"), HasSubstr("/elsewhere/palpate")));
    io::set_decoder_program({});
    EXPECT_TRUE(load_volume("well"));
}

} // namespace
} // namespace palpate
