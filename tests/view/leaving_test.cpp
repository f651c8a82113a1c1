// What a person is asked before edits are lost: after saves that fail, and of a mesh that was
// pulled.

#include <sys/resource.h>

#include <csignal>
#include <thread>

#include "apps/palpate/view/work.h"
#include "tests/support/temporary_folder.h"
#include "tests/view/viewer_fixture.h"

namespace palpate::view {
namespace {

// With threads, as in a window: such a document can be saved.
class Leaving : public TemporaryFolder {
 protected:
    Work work_{Source{open_synthetic("synthetic:ball?size=24")}, {800, 600}, 1.0, true};
    ViewState state_ = work_.subject().home;

    void measure() {
        Measure ruler;
        ruler.kind = MeasureKind::ruler;
        ruler.points_mm = {glm::dvec3(0.0),
                           glm::dvec3(1.0 + double(state_.measuring.measures.size()))};
        state_.measuring.measures.push_back(ruler);
        work_.watch(state_);
    }
    // What the person is told.
    std::string save(const std::filesystem::path& folder) {
        work_.save(state_, folder.string());
        EXPECT_TRUE(work_.leaving_loses_edits()); // until it has ended
        while (work_.is_saving()) {
            work_.poll();
            std::this_thread::yield();
        }
        return work_.take_message();
    }
};

TEST_F(Leaving, MeasuresOfANewProjectThatCannotBeWrittenAreAskedFor) {
    EXPECT_FALSE(work_.leaving_loses_edits());
    measure();
    EXPECT_TRUE(work_.leaving_loses_edits());
    write("file", "no folder");
    EXPECT_NE(save(file("file") / "work.palpate"), "");
    EXPECT_FALSE(work_.has_project());
    EXPECT_TRUE(work_.leaving_loses_edits());
    EXPECT_NE(save(file("work.palpate")).find("saved to"), std::string::npos);
    EXPECT_TRUE(work_.has_project());
    EXPECT_FALSE(work_.leaving_loses_edits());
}

// The limit on the size of files stands for a disk that is full.
TEST_F(Leaving, MeasuresOfALaterSaveThatFailsAreAskedFor) {
    measure();
    save(file("work.palpate"));
    ASSERT_FALSE(work_.leaving_loses_edits());
    measure();
    ::signal(SIGXFSZ, SIG_IGN);
    rlimit old{};
    ::getrlimit(RLIMIT_FSIZE, &old);
    rlimit little = old;
    little.rlim_cur = 600; // a journal begins, project.json is larger
    ::setrlimit(RLIMIT_FSIZE, &little);
    const std::string told = save({});
    ::setrlimit(RLIMIT_FSIZE, &old);
    EXPECT_EQ(told.find("saved to"), std::string::npos) << told;
    EXPECT_NE(told, "");
    EXPECT_TRUE(work_.leaving_loses_edits());
    EXPECT_NE(save({}).find("saved to"), std::string::npos);
    EXPECT_FALSE(work_.leaving_loses_edits());
}

// A measure that is made while a save is under way is not in it.
TEST_F(Leaving, MeasuresMadeDuringASaveAreAskedFor) {
    measure();
    work_.save(state_, file("work.palpate").string());
    measure();
    while (work_.is_saving()) {
        work_.poll();
        std::this_thread::yield();
    }
    EXPECT_TRUE(work_.leaving_loses_edits());
    save({});
    EXPECT_FALSE(work_.leaving_loses_edits());
}

} // namespace
} // namespace palpate::view
