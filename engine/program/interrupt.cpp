#include "engine/program/interrupt.h"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>

#include "engine/base/assert.h"

namespace palpate {

namespace {

// The handler may only write to a pipe; the thread at its other end does the rest.
std::atomic<int> g_wake{-1};

void on_signal(int signal) {
    ::signal(signal, SIG_DFL);
    const char byte = 's';
    (void)!::write(g_wake.load(), &byte, 1);
}

} // namespace

Interrupt::Interrupt() {
    const int made = ::pipe2(wake_, O_CLOEXEC);
    PALPATE_ASSERT(made == 0);
    PALPATE_ASSERT_CMP(g_wake.exchange(wake_[1]), ==, -1); // one at a time
    listener_ = std::thread([this] {
        char byte = 0;
        if (::read(wake_[0], &byte, 1) == 1 && byte == 's')
            source_.request_stop();
    });
    ::signal(SIGINT, on_signal);
    ::signal(SIGTERM, on_signal);
}

Interrupt::~Interrupt() {
    ::signal(SIGINT, SIG_DFL);
    ::signal(SIGTERM, SIG_DFL);
    const char byte = 'q';
    (void)!::write(wake_[1], &byte, 1);
    listener_.join();
    g_wake = -1;
    ::close(wake_[0]);
    ::close(wake_[1]);
}

} // namespace palpate
