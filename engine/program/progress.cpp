#include "engine/program/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

#include "engine/base/printable.h"

namespace palpate {

Progress::Progress(std::string what) : what_(printable(what)), terminal_(::isatty(2) == 1) {}

Progress::~Progress() {
    if (shown_percent_ >= 0)
        fmt::print(stderr, "\r\x1b[K");
}

void Progress::show(double share) {
    const int percent = static_cast<int>(100.0 * share);
    if (!terminal_ || percent == shown_percent_)
        return;
    shown_percent_ = percent;
    fmt::print(stderr, "\r{}: {} %", what_, percent);
    std::fflush(stderr);
}

} // namespace palpate
