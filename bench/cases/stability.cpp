#include "bench/cases/stability.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/base/timer.h"

namespace palpate::cases {

bool CaseResult::pass() const {
    return !lines.empty() &&
           std::all_of(lines.begin(), lines.end(), [](const Line& line) { return line.pass(); });
}

std::vector<CaseResult> run_hard_cases(Painter& painter,
                                       const std::function<void(const CaseResult&)>& done,
                                       std::stop_token stop) {
    std::vector<CaseResult> results;
    for (const HardCase& hard_case : hard_cases()) {
        if (stop.stop_requested())
            break;
        const Timer timer;
        results.push_back({&hard_case, run(hard_case, painter), 0.0});
        results.back().ms = timer.ms();
        done(results.back());
    }
    return results;
}

std::string describe(const CaseResult& result) {
    std::string text = fmt::format("{:4} {:4}  {}\n", result.hard_case->name,
                                   result.pass() ? "pass" : "FAIL", result.hard_case->title);
    for (const Line& line : result.lines) {
        text += fmt::format("            {}: {:.2g}, bound {:.2g}\n", line.part, line.figure,
                            line.bound);
        if (!line.pass())
            text += fmt::format("            {} of {} checks failed; {}\n", line.failed,
                                line.checks, line.sentence);
    }
    return text;
}

Json to_json(const std::vector<CaseResult>& results) {
    Json json;
    json["cases"] = Json::array();
    for (const CaseResult& result : results) {
        Json lines = Json::array();
        for (const Line& line : result.lines)
            lines.push_back({{"part", line.part},
                             {"figure", line.figure},
                             {"bound", line.bound},
                             {"checks", line.checks},
                             {"failed", line.failed},
                             {"worst", line.worst},
                             {"pass", line.pass()},
                             {"sentence", line.sentence}});
        json["cases"].push_back({{"name", result.hard_case->name},
                                 {"title", result.hard_case->title},
                                 {"why", result.hard_case->why},
                                 {"pass", result.pass()},
                                 {"ms", result.ms},
                                 {"lines", lines}});
    }
    json["passed"] = std::count_if(results.begin(), results.end(),
                                   [](const CaseResult& result) { return result.pass(); });
    json["count"] = results.size();
    return json;
}

} // namespace palpate::cases
