#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace palpate::cases {

// One line of a case's result: of all errors measured, the one that uses the largest share of its
// bound, and that bound.
struct Line {
    std::string part;     // the measurement and its integrator
    double figure = 0.0;  // in the unit that `part` names
    double bound = 0.0;   // 0 means exact
    uint64_t checks = 0;  // how many errors were held against a bound
    uint64_t failed = 0;  // how many lay beyond, or were not numbers
    std::string worst;    // where the figure was found
    std::string sentence; // the first failure, if any

    bool pass() const { return checks > 0 && failed == 0; }
};

// Gathers what a hard case measures.
class Findings {
 public:
    // Later findings belong to this line; a new one, or the one of that name.
    void part(const std::string& name);
    // The place of the findings: a scene, and a pixel of it.
    void in(std::string scene) { scene_ = std::move(scene); }
    void at(uint32_t x, uint32_t y) { x_ = x, y_ = y; }

    // Holds |error| <= bound; NaN is beyond every bound.
    void within(double error, double bound);
    void near(double found, double expected, double bound) { within(found - expected, bound); }
    // A condition without a figure. `sentence` says what was expected.
    void expect(bool holds, const char* sentence);

    const std::vector<Line>& lines() const { return lines_; }

 private:
    Line& line();
    std::string place() const;

    std::vector<Line> lines_;
    size_t current_ = 0;
    std::string scene_;
    uint32_t x_ = 0, y_ = 0;
};

} // namespace palpate::cases
