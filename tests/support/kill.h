#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "tests/support/paths.h"

namespace palpate {

// How a child process that ran `work` ended.
enum class End { finished, failed, killed };

// Runs `work` in a child, which exits with what it returns (or becomes another program), and sends
// it `signal` after `delay` unless it has ended. Returns how it ended, as waitpid() says it, when
// the child and all its descendants are gone, so one that outlives its parent is a test that hangs.
// The child has one thread, whatever this has.
inline int run_and_signal(std::chrono::microseconds delay, int signal,
                          const std::function<int()>& work) {
    ::prctl(PR_SET_CHILD_SUBREAPER, 1); // orphaned descendants become ours to wait for
    const pid_t child = ::fork();
    if (child == 0)
        ::_exit(work());
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(delay);
    const timespec limit{seconds.count(), std::chrono::nanoseconds(delay - seconds).count()};
    pollfd ended{static_cast<int>(::syscall(SYS_pidfd_open, child, 0)), POLLIN, 0};
    ::ppoll(&ended, 1, &limit, nullptr);
    ::close(ended.fd);
    ::kill(child, signal); // no harm to one that has ended
    int status = 0;
    ::waitpid(child, &status, 0);
    while (::waitpid(-1, nullptr, 0) > 0) {
    }
    return status;
}

inline End run_and_kill(std::chrono::microseconds delay, const std::function<int()>& work) {
    const int status = run_and_signal(delay, SIGKILL, work);
    if (WIFSIGNALED(status))
        return WTERMSIG(status) == SIGKILL ? End::killed : End::failed;
    return WEXITSTATUS(status) == 0 ? End::finished : End::failed;
}

// For a child: becomes the program; what it prints goes nowhere, or its messages to a file that is
// open.
inline int become_program(std::vector<std::string> arguments, int messages = -1) {
    arguments.insert(arguments.begin(), kProgram);
    std::vector<char*> argv;
    for (std::string& argument : arguments)
        argv.push_back(argument.data());
    argv.push_back(nullptr);
    const int nowhere = ::open("/dev/null", O_RDWR);
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        ::dup2(stream == STDERR_FILENO && messages >= 0 ? messages : nowhere, stream);
    return ::execv(kProgram, argv.data());
}

// Kills `work` at `count` moments of its life and calls `check` after each run. Half of the moments
// are spread over the time of a whole run, half over its last quarter, where files are written. The
// moments come from the clock and so differ from run to run; what is checked must hold at any.
inline void kill_at_many_moments(int count, const std::function<int()>& work,
                                 const std::function<void()>& check) {
    using Clock = std::chrono::steady_clock;
    const std::chrono::hours forever(1);
    Clock::time_point start = Clock::now();
    ASSERT_EQ(run_and_kill(forever, work), End::finished) << "the work fails undisturbed";
    std::chrono::duration<double> whole = Clock::now() - start;

    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    int killed = 0, finished = 0;
    while (killed < count) {
        const double share = random() % 2 ? 0.75 + 0.3 * uniform(random) : uniform(random);
        start = Clock::now();
        const End end = run_and_kill(
            std::chrono::duration_cast<std::chrono::microseconds>(share * whole), work);
        ASSERT_NE(end, End::failed);
        if (end == End::finished) { // the machine is faster now than it was: aim earlier
            whole = 0.5 * (whole + (Clock::now() - start));
            ASSERT_LT(++finished, 20 * count) << "it ends before it can be killed";
        }
        killed += end == End::killed;
        check();
        if (testing::Test::HasFatalFailure())
            return;
    }
}

// Interrupts `work`, which becomes the program, at moments spread over the time of a whole run
// until `count` runs have noticed, ended with exit status 1 and so said it. Calls `check` after
// each run, with whether it was done. The moments follow the speed of the machine.
inline void interrupt_at_many_moments(int count, const std::function<int()>& work,
                                      const std::function<void(bool is_done)>& check) {
    using Clock = std::chrono::steady_clock;
    Clock::time_point start = Clock::now();
    ASSERT_EQ(run_and_kill(std::chrono::hours(1), work), End::finished);
    const std::chrono::duration<double> whole = Clock::now() - start;
    std::mt19937 random(1);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    for (int stopped = 0, runs = 0; stopped < count; ++runs) {
        ASSERT_LT(runs, 40 * count) << "it ends before it can be interrupted";
        const int status = run_and_signal(
            std::chrono::duration_cast<std::chrono::microseconds>(share(random) * whole), SIGINT,
            work);
        const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 0;
        // Before the program listens, the signal itself ends it.
        ASSERT_TRUE(code <= 1 && (WIFEXITED(status) || WTERMSIG(status) == SIGINT)) << status;
        stopped += code == 1;
        check(WIFEXITED(status) && code == 0);
        if (testing::Test::HasFatalFailure())
            return;
    }
}

} // namespace palpate
