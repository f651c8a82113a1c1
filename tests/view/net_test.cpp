// A net on a server, in the window.

#include <gmock/gmock.h>

#include <thread>

#include "apps/view/document/net_method.h"
#include "apps/view/document/segment_run.h"
#include "engine/volume/builder.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/net/fake_server.h"
#include "tests/view/recorded_session.h"

namespace palpate::view {
namespace {

using ::testing::HasSubstr;

class NetInTheWindow : public ViewerTest {
 protected:
    NetInTheWindow()
        : folder_(std::filesystem::temp_directory_path() /
                  ("palpate.net_view." + std::to_string(::getpid()))),
          fake_(folder_ / "interactive", {}) {}
    ~NetInTheWindow() override { std::filesystem::remove_all(folder_); }
    void SetUp() override {
        ViewerTest::SetUp();
        open("synthetic:phantom?size=24", {800, 900});
        key("q");
        move(middle(Panel::axial) + glm::dvec2(-15, 15));
        button(true);
        move(middle(Panel::axial) + glm::dvec2(15, 15));
        button(false);
        frame({});
        show("method");
        click_widget("segment/methods");
        click_widget("segment/method/net");
    }
    void type_server() {
        click_widget("segment/net/server", 0.05);
        frame({{.kind = Event::Kind::text, .text = fake_.url()}});
        frame({});
    }
    void run() {
        click_widget("segment/run");
        frame({});
    }
    size_t steps() { return viewer().work().edited().undo_steps; }
    std::vector<float> samples(const char* name) {
        const Document document = viewer().work().edited().document;
        std::vector<float> values;
        const Volume& map = *document.find(name);
        for (uint32_t z = 0; z < 24; ++z)
            for (uint32_t y = 0; y < 24; ++y)
                for (uint32_t x = 0; x < 24; ++x)
                    values.push_back(map.value({x, y, z}));
        return values;
    }

    std::filesystem::path folder_;
    FakeServer fake_;
};

TEST_F(NetInTheWindow, NothingIsSentBeforeAPersonAgrees) {
    const size_t before = steps();
    run();
    EXPECT_THAT(viewer().interface().message(), HasSubstr("name a server first"));
    type_server();
    run();
    EXPECT_THAT(viewer().interface().message(),
                HasSubstr("all 24 x 24 x 24 samples of the volume, its place in the patient, the "
                          "seeds, and labels "
                          "to start from, go to " +
                          fake_.url()));
    EXPECT_EQ(fake_.requests(), "");
    EXPECT_EQ(steps(), before);
    // An agreement is for the server that was named then.
    click_widget("segment/net/send", 0.05);
    click_widget("segment/net/server", 0.05);
    key("end");
    frame({{.kind = Event::Kind::text, .text = "/a"}});
    frame({});
    EXPECT_EQ(state().own.of<NetWish>().server, fake_.url() + "/a"); // which the fake would answer
    EXPECT_FALSE(state().own.of<NetWish>().is_agreed());
    run();
    EXPECT_EQ(fake_.requests(), "");
    // And for this document alone.
    click_widget("segment/net/send", 0.05);
    EXPECT_TRUE(state().own.of<NetWish>().is_agreed());
    frame({{.kind = Event::Kind::drop, .paths = {"synthetic:phantom?size=24"}}});
    frame({});
    click_widget("leave/discard");
    frame({});
    frame({});
    EXPECT_EQ(state().own.of<NetWish>(), NetWish());
}

// The fake server's net gives a scribble back: the labels are the seeds then.
TEST_F(NetInTheWindow, TheResultIsOneStepWithTheLicence) {
    type_server();
    click_widget("segment/net/send", 0.05);
    const size_t before = steps();
    const std::vector<float> seeds = samples(Work::kSeeds);
    run();
    EXPECT_EQ(steps(), before + 1);
    EXPECT_EQ(samples(Work::kLabels), seeds);
    EXPECT_THAT(viewer().interface().message(), HasSubstr("CC BY-NC-SA 4.0"));
    key("z", {.ctrl = true});
    EXPECT_EQ(samples(Work::kLabels), std::vector<float>(seeds.size()));
}

TEST_F(NetInTheWindow, AFaultIsASentenceAndChangesNothing) {
    type_server();
    click_widget("segment/net/send", 0.05);
    const size_t before = steps();
    for (const auto& [fault, words] : {std::pair{"410=/add", "the lease has ended"},
                                       {"503=/claim", "full"},
                                       {"401=/claim", "another key"},
                                       {"cut=/add", "expected"},
                                       {"damage=/add", "expected"},
                                       {"shape=/add", "expected an array"},
                                       {"outside=/add", "expected the box"}}) {
        fake_.set_faults({fault});
        run();
        EXPECT_THAT(viewer().interface().message(),
                    ::testing::AllOf(HasSubstr(fake_.url()), HasSubstr(words)))
            << fault;
        EXPECT_EQ(steps(), before) << fault;
    }
}

// While a server is silent the run is on its thread; a stop ends it.
TEST_F(NetInTheWindow, ARunOfASilentServerIsNotAwaited) {
    fake_.set_faults({"silence=/claim"});
    const Grid grid = make_grid({8, 8, 8}, {1, 1, 1});
    const Volume volume = make_volume(grid, ScalarType::i16, [](glm::uvec3) { return 1.0; });
    const Volume seeds =
        make_volume(grid, ScalarType::u8, [](glm::uvec3 at) { return double(at.x == 3); });
    const Volume none = make_volume(grid, ScalarType::u8, [](glm::uvec3) { return 0.0; });
    const auto kept = net_run({fake_.url(), "", fake_.url()}, volume);
    ASSERT_TRUE(kept) << kept.error().message;
    SegmentJob job{.method = &net_method(), .volume = volume, .labels = none, .seeds = seeds};
    job.kept = *kept;
    SegmentRun run(std::move(job), true);
    while (fake_.requests().find("POST /claim") == std::string::npos)
        std::this_thread::yield();
    EXPECT_FALSE(run.take());
    run.stop();
    std::optional<Result<SegmentDone>> taken;
    while (!(taken = run.take()))
        std::this_thread::yield();
    ASSERT_FALSE(*taken);
    EXPECT_EQ(taken->error().message, "stopped before it was done");
}

} // namespace
} // namespace palpate::view
