#pragma once

#include <span>

#include "bench/suite/panel.h"

namespace palpate::bench {

struct Suite {
    const char* name;
    const char* purpose;
    Result<Report> (*run)(Bench& bench);
};

// One file a suite.
Result<Report> run_edit(Bench& bench);
Result<Report> run_frame(Bench& bench);
Result<Report> run_quality(Bench& bench);
Result<Report> run_render(Bench& bench);
Result<Report> run_segment(Bench& bench);
Result<Report> run_stability(Bench& bench);
Result<Report> run_surface(Bench& bench);
Result<Report> run_touch(Bench& bench);
Result<Report> run_upload(Bench& bench);

std::span<const Suite> suites();

// Runs a suite by its name, one of suites(), and writes OUT/NAME.json and OUT/index.html, which
// shows every suite whose result lies in OUT. The error is the first of the report's failures and
// how many there are; files are written even so.
Result<void> run_suite(const std::string& name, const Options& options);

} // namespace palpate::bench
