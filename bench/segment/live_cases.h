#pragma once

#include <span>
#include <vector>

#include "engine/segment/task.h"

// Times of single answers that a person waits for while the hand moves.
namespace palpate::bench {

struct LiveTimes {
    std::vector<double> ms;     // of each answer, in their order
    std::vector<double> errors; // of some answers, against an independent reference
};

struct LiveCase {
    const char* name;
    const char* setting;
    double wanted_ms; // that 95 % of the answers should not exceed
    Result<LiveTimes> (*run)(bool tiny, const Task& task);
};
std::span<const LiveCase> live_cases();

} // namespace palpate::bench
