#include <gmock/gmock.h>

#include "engine/io/volume_io.h"
#include "engine/volume/builder.h"
#include "tests/support/program.h"
#include "tests/unit/net/fake_server.h"

namespace palpate {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// `palpate segment --method net`, with a server that finds a ball of radius 3 about a point.
class SegmentNetCommand : public ProgramTest {
 protected:
    SegmentNetCommand() {
        const Grid grid = make_grid({20, 16, 12}, {1, 1, 2});
        EXPECT_TRUE(save_volume(
            file("v.nrrd"), make_volume(grid, ScalarType::i16,
                                        [](glm::uvec3 at) { return at.x > 12 ? 100.0 : 0.0; })));
        write("s.json", R"({"seeds": 1, "units": "mm", "background": 2, "points": [
            {"label": 4, "at_mm": [5, 6, 8]}, {"label": 2, "at_mm": [15, 6, 8]}]})");
    }
    std::string path(const std::string& name) const { return file(name).string(); }
    ProgramRun segment(const FakeServer& fake, std::vector<std::string> more) const {
        more.insert(more.begin(),
                    {"segment", path("v.nrrd"), "--method", "net", "--send-to",
                     "127.0.0.1:" + std::to_string(fake.port()), "-o", path("o.nrrd")});
        return run(more);
    }
    // Samples of a label.
    size_t count(float label) const {
        const Result<LoadedVolume> labels = load_labels(file("o.nrrd"));
        EXPECT_TRUE(labels);
        size_t found = 0;
        for (uint32_t z = 0; z < 12; ++z)
            for (uint32_t y = 0; y < 16; ++y)
                for (uint32_t x = 0; x < 20; ++x)
                    found += labels->volume.value({x, y, z}) == label;
        return found;
    }
};

TEST_F(SegmentNetCommand, NothingLeavesWithoutConsent) {
    const FakeServer fake(file("interactive"), {});
    const ProgramRun refused = segment(fake, {"--seeds", path("s.json")});
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_THAT(
        refused.messages,
        AllOf(HasSubstr("all 20 x 16 x 12 samples of the volume, its place in the patient, the "
                        "seeds, and labels to start from, go to " +
                        fake.url() + ", not encrypted"),
              HasSubstr("--consent")));
    EXPECT_EQ(fake.requests(), "");
    EXPECT_FALSE(std::filesystem::exists(file("o.nrrd")));
}

TEST_F(SegmentNetCommand, ANetSegmentsFromPoints) {
    const FakeServer fake(file("interactive"), {});
    write("key", "secret1\n");
    const ProgramRun made =
        segment(fake, {"--seeds", path("s.json"), "--consent", "--key-file", path("key")});
    ASSERT_EQ(made.exit_code, 0) << made.messages;
    EXPECT_THAT(made.messages,
                AllOf(HasSubstr("CC BY-NC-SA 4.0"), HasSubstr("go to"), Not(HasSubstr("secret1"))));
    // Points of a ball of radius 3 in a lattice: 123.
    EXPECT_EQ(count(4.0f), 123u);
    EXPECT_EQ(count(0.0f), 20u * 16 * 12 - 123);
    EXPECT_THAT(fake.requests(), AllOf(HasSubstr("POST /claim 0 Bearer secret1"),
                                       testing::EndsWith("POST /release 0 Bearer secret1\n")));
}

TEST_F(SegmentNetCommand, AModelSegmentsAndOthersAreNamed) {
    const FakeServer fake(file("monai"), {});
    const ProgramRun unnamed = segment(fake, {"--consent"});
    EXPECT_EQ(unnamed.exit_code, 1);
    EXPECT_THAT(unnamed.messages, HasSubstr("expected one of the models spleen, edit 3d"));
    const ProgramRun made = segment(fake, {"--consent", "--model", "spleen", "--classes", "3"});
    ASSERT_EQ(made.exit_code, 0) << made.messages;
    EXPECT_THAT(made.messages, HasSubstr("--classes changes nothing: net has no such parameter"));
    EXPECT_THAT(made.messages, HasSubstr("Apache-2.0"));
    EXPECT_EQ(count(3.0f), 7u * 16 * 12);
}

TEST_F(SegmentNetCommand, AFailureLeavesNoFile) {
    const FakeServer fake(file("interactive"), {});
    for (const char* fault :
         {"410=/add_point", "503=/claim", "cut=/add_point", "silence=/add_point"}) {
        fake.set_faults({fault});
        const bool is_silent = std::string_view(fault).starts_with("silence");
        const ProgramRun failed = segment(fake, {"--seeds", path("s.json"), "--consent",
                                                 "--net-timeout", is_silent ? "1" : "60"});
        EXPECT_EQ(failed.exit_code, 1) << fault;
        EXPECT_THAT(failed.messages, HasSubstr(fake.url()));
        EXPECT_FALSE(std::filesystem::exists(file("o.nrrd")));
    }
}

} // namespace
} // namespace palpate
