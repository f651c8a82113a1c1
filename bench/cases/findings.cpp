#include "bench/cases/findings.h"

#include <fmt/format.h>

#include <cmath>

namespace palpate::cases {

namespace {

// How much of its bound an error uses: 0 where an exact answer was met.
double share(double error, double bound) {
    return error == 0.0 ? 0.0 : error / bound;
}

} // namespace

void Findings::part(const std::string& name) {
    for (current_ = 0; current_ < lines_.size(); ++current_)
        if (lines_[current_].part == name)
            return;
    lines_.emplace_back().part = name;
}

Line& Findings::line() {
    if (lines_.empty())
        lines_.emplace_back();
    return lines_[current_];
}

std::string Findings::place() const {
    return fmt::format("{}, pixel {} {}", scene_, x_, y_);
}

void Findings::within(double error, double bound) {
    Line& found = line();
    const double size = std::abs(error);
    const bool first = found.checks++ == 0;
    if (!(size <= bound) && found.failed++ == 0)
        found.sentence =
            fmt::format("{}: expected at most {:.3g}, found {:.3g}", place(), bound, size);
    const double uses = share(size, bound), most = share(found.figure, found.bound);
    if (first || uses > most || (uses == most && bound > found.bound) || std::isnan(size)) {
        found.figure = size;
        found.bound = bound;
        found.worst = place();
    }
}

void Findings::expect(bool holds, const char* sentence) {
    Line& found = line();
    ++found.checks;
    if (!holds && found.failed++ == 0)
        found.sentence = fmt::format("{}: expected {}", place(), sentence);
}

} // namespace palpate::cases
