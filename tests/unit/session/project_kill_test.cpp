// A project loses no step that had ended, whenever the process that works on it is killed.
// PALPATE_KILLS is how often: few in `quick`.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <map>

#include "tests/support/given.h"
#include "tests/support/kill.h"
#include "tests/unit/session/project_fixture.h"

namespace palpate {
namespace {

// A child has the threads it makes, so it is this program again.
int become_worker(const char* job, const fs::path& folder, int told) {
    ::setenv("PALPATE_JOB", job, 1);
    ::setenv("PALPATE_FOLDER", folder.c_str(), 1);
    ::setenv("PALPATE_TOLD", std::to_string(told).c_str(), 1);
    ::dup2(::open("/dev/null", O_RDWR), STDOUT_FILENO);
    return ::execl("/proc/self/exe", "test", "--gtest_also_run_disabled_tests",
                   "--gtest_filter=ProjectWorker.*", static_cast<char*>(nullptr));
}

TEST(ProjectWorker, DISABLED_Works) {
    const char *job = std::getenv("PALPATE_JOB"), *folder = std::getenv("PALPATE_FOLDER");
    ASSERT_TRUE(job && folder);
    const int told = std::atoi(std::getenv("PALPATE_TOLD"));
    if (job == std::string("create")) {
        const Result<void> made = Project::create(folder, contents());
        ASSERT_TRUE(made) << made.error().message;
        return;
    }
    const Result<void> done = work(folder, 0, kActs, [&](int n) {
        const auto byte = static_cast<uint8_t>(1 + n);
        ASSERT_EQ(::write(told, &byte, 1), 1);
    });
    ASSERT_TRUE(done) << done.error().message;
}

TEST_F(ProjectTest, LosesNoStepThatHadEndedWheneverItIsKilled) {
    make();
    fs::copy(file("p"), file("fresh"), fs::copy_options::recursive);
    (void)expected();
    int told[2];
    ASSERT_EQ(::pipe2(told, O_NONBLOCK), 0);
    std::map<uint64_t, int> saves;
    kill_at_many_moments(
        int(given("PALPATE_KILLS", 8)),
        [&] {
            if (::write(told[1], "", 1) != 1) // 0: nothing is opened yet
                return 1;
            take_away();
            fs::remove_all(file("copy"));
            fs::copy(file("fresh"), file("copy"), fs::copy_options::recursive);
            fs::rename(file("copy"), file("p"));
            return become_worker("work", file("p"), told[1]);
        },
        [&] {
            uint8_t last = 0; // 1 + how many acts had ended
            for (uint8_t n = 0; ::read(told[0], &n, 1) == 1;)
                last = n;
            if (last == 0)
                return;
            const size_t done = last - 1u;
            {
                const Result<Project::Opened> opened = Project::open(file("p"));
                ASSERT_TRUE(opened) << opened.error().message;
                const std::string there = all_of(opened->setup.document);
                ASSERT_TRUE(there == expected()[done] ||
                            (done < size_t(kActs) && there == expected()[done + 1]))
                    << done << " acts had ended";
                ++saves[opened->project.saves()];
            }
            // And it can be gone on with, through another save.
            const Result<void> on = work(file("p"), 4, 6, [](int) {});
            ASSERT_TRUE(on) << on.error().message;
        });
    for (const auto& [save, times] : saves)
        std::printf("    killed after save %d: %d times\n", int(save), times);
    ::close(told[0]);
    ::close(told[1]);
}

TEST_F(ProjectTest, IsMadeWholeOrNotAtAll) {
    int whole = 0, none = 0;
    kill_at_many_moments(
        int(given("PALPATE_KILLS", 8)),
        [&] {
            take_away();
            return become_worker("create", file("p"), 2);
        },
        [&] {
            if (fs::exists(file("p"))) {
                ASSERT_EQ(what_is_there(), all_of(head_and_organs()));
                ++whole;
            } else {
                ++none;
            }
        });
    std::printf("    whole %d, none %d\n", whole, none);
}

} // namespace
} // namespace palpate
