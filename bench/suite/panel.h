#pragma once

#include "bench/suite/measure.h"
#include "bench/suite/peers.h"

namespace palpate::bench {

// The result of a suite. Sentences of `failures` make the run fail.
struct Report {
    Json json;
    std::vector<std::string> failures;
};

// Adds a row to the page's list of aims.
void add_aim(Json& aims, const std::string& what, const std::string& aim, const Json& figure,
             bool reached);

// One subject's points, ours and the peers', as the page and the JSON show them: which of ours lie
// on the front (time by fenced wall clock against RMSE), whether the default does, and whether each
// peer's point has one of ours strictly below it, both faster and more exact. Adds a sentence to
// `failures` where the default of a judged subject is beaten beyond noise.
Json panel_json(const Subject& subject, const std::vector<Bench::Drawn>& ours,
                const std::vector<PeerPoint>& peers, Sampling sampling,
                std::vector<std::string>& failures);

// Saves |picture - truth| as a picture for the page; `scale` is what is shown brightest.
Result<Json> map_json(const Bench& bench, const std::string& title, const Image& picture,
                      const Image& truth, const Subject& subject, double scale);

// How the error of an integrator falls with the step (or the sub-step): the fitted order. Steps are
// halved from one to the next. Where the last halving leaves 1.25 times the share of the error that
// the one before it left, rounding has set a floor, and only points at least four times above the
// smallest error are fitted: what the floor adds there is below 1/16 of the square.
Json convergence_json(const std::string& title, const std::string& integrator,
                      const std::vector<double>& steps, const std::vector<double>& errors);

} // namespace palpate::bench
