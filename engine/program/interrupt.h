#pragma once

#include <stop_token>
#include <thread>

namespace palpate {

// While one of these lives, Ctrl-C (SIGINT) and SIGTERM ask `token()` to stop instead of ending the
// program, so that a command can take back what it has half done; the same signal again ends it.
class Interrupt {
 public:
    Interrupt();
    ~Interrupt();
    Interrupt(const Interrupt&) = delete;
    Interrupt& operator=(const Interrupt&) = delete;

    std::stop_token token() const { return source_.get_token(); }

 private:
    std::stop_source source_;
    std::thread listener_;
    int wake_[2];
};

} // namespace palpate
