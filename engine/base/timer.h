#pragma once

#include <chrono>

namespace palpate {

// Wall clock since construction, in milliseconds.
class Timer {
 public:
    double ms() const {
        return std::chrono::duration<double, std::milli>(Clock::now() - start_).count();
    }

 private:
    using Clock = std::chrono::steady_clock;
    Clock::time_point start_ = Clock::now();
};

} // namespace palpate
