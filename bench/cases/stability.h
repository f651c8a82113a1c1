#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <vector>
#include "engine/base/json.h"

#include "bench/cases/hard_case.h"

// The suite `stability` of `palpate bench`: every hard case by name.
namespace palpate::cases {

struct CaseResult {
    const HardCase* hard_case;
    std::vector<Line> lines;
    double ms = 0.0;

    bool pass() const;
};

// Runs all, and tells `done` after each; ends early when `stop` asks for it.
std::vector<CaseResult> run_hard_cases(Painter& painter,
                                       const std::function<void(const CaseResult&)>& done,
                                       std::stop_token stop = {});

// For people: one row for the case, one for each of its lines, a sentence where it failed.
std::string describe(const CaseResult& result);

// {"cases": [{"name", "title", "why", "pass", "ms", "lines": [{"part", "figure", "bound",
// "checks", "failed", "worst", "pass", "sentence"}]}], "passed", "count"}. A figure that is not
// finite is null.
Json to_json(const std::vector<CaseResult>& results);

} // namespace palpate::cases
