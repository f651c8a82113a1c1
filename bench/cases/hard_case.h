#pragma once

#include <span>
#include <vector>

#include "bench/cases/findings.h"
#include "bench/cases/painter.h"

// Scenes that break careless ray casters, numbered R1 .. R23 as in the study that collected them,
// each with the answer that a correct renderer must give and a bound derived from the precision it
// works in. Tests run them one by one, on the GPU and on its fp64 twin; `palpate bench stability`
// prints them all.
namespace palpate::cases {

struct HardCase {
    const char* name;  // "R1"
    const char* title; // the difficulty
    const char* why;   // the fault where it is not handled
    void (*run)(Painter& painter, Findings& findings);
};

// In the order of their numbers.
std::span<const HardCase> hard_cases();

// Runs one; a scene that cannot be drawn is a failure that says why.
std::vector<Line> run(const HardCase& hard_case, Painter& painter);

} // namespace palpate::cases
