// The hard cases R1 .. R23 by name: what each measured, and its bound.

#include "bench/cases/stability.h"

#include "bench/suite/suites.h"

namespace palpate::bench {

Result<Report> run_stability(Bench& bench) {
    cases::GpuPainter painter(bench.device());
    const auto results = cases::run_hard_cases(
        painter,
        [](const cases::CaseResult& result) {
            fmt::print("{}", cases::describe(result));
            std::fflush(stdout);
        },
        bench.options().stop);
    if (bench.options().stop.stop_requested())
        return fail("interrupted after {} of {} hard cases", results.size(),
                    cases::hard_cases().size());
    Report report;
    report.json = cases::to_json(results);
    for (const cases::CaseResult& result : results)
        for (const cases::Line& line : result.lines)
            if (!line.pass())
                report.failures.push_back(
                    fmt::format("{}, {}: {}", result.hard_case->name, line.part,
                                line.checks == 0 ? "nothing was checked" : line.sentence));
    fmt::print("{} of {} hard cases pass\n", report.json["passed"].number, results.size());
    return report;
}

} // namespace palpate::bench
