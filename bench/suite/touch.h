#pragma once

#include <map>

#include "bench/suite/suites.h"
#include "bench/touch/figures.h"
#include "bench/touch/scenes.h"
#include "haptics/proxy/algorithms.h"

// The parts of `palpate bench touch`.
namespace palpate::bench {

struct TouchPlan {
    size_t ticks;             // of a trajectory, at most
    bool all;                 // every angle, thickness and speed
    bool storages;            // beyond 0.5 mm floats
    uint32_t places, ct_side; // of A11: in each volume; the CT resampled to so many, 0 as it is
    uint32_t z_columns, z_rows;
    size_t timed_ticks;
    uint64_t family_seeds; // each 20 scenes
};
TouchPlan touch_plan(const Options& options);

// The parts of the suite to run.
struct TouchParts {
    bool open_loop = false; // all scenes but A11, with a hand that goes its way
    bool patients = false;  // the same of A11
    bool closed_loop = false, times = false, laws = false, z_width = false;
    bool family = false, family_held = false;        // seeds of development; held ones, where named
    std::vector<haptics::AlgorithmEntry> algorithms; // of all parts but z_width

    bool has(std::string_view algorithm) const;
    bool takes(haptics::Takes what) const;  // one of the algorithms
    std::vector<std::string> names() const; // as --only takes them
};
// All of it where --only names nothing. Where it names no algorithm all of them are run, and where
// it names no part the open loop. Fails where it names something else.
Result<TouchParts> touch_parts(const std::vector<std::string>& only);

// Calls visit for every scene that a loop asks for, in every storage, with meshes where they are
// felt. Volumes of A11 that are not there become a sentence of `notes`.
Result<void> for_each_touch_scene(
    const TouchPlan& plan, const TouchParts& parts, const Options& options, Json& notes,
    const std::function<Result<void>(const touch::Scene& scene, const std::string& stored)>& visit);

// Sampled tools are balls of 1.5 voxels, up to which rounded corners have a closed form.
haptics::TouchParameters touch_parameters(const touch::Scene& scene);
haptics::TouchParameters parameters_of(const haptics::AlgorithmEntry& entry,
                                       const touch::Scene& scene,
                                       const haptics::TouchParameters& shared);

// Why an algorithm is not asked about a scene; empty where it is.
std::string why_empty(const haptics::AlgorithmEntry& entry, const touch::Scene& scene);

// The largest figure of any cell, and whose it is.
struct WorstCell {
    double figure = 0.0;
    std::string where; // of equals the first by name, so that the order of cells does not matter
    void keep(double value, const std::string& cell);
};

// Totals of one algorithm over the whole grid, by the names of touch_grid.cpp: sums, the largest
// figures, and the directions of all ticks, of which the worst cell's percentile says less.
struct TouchTotals {
    std::map<std::string, uint64_t> counts;
    std::map<std::string, WorstCell> worst;
    std::map<std::string, touch::Histogram> pooled;
};
using AllTotals = std::map<std::string, TouchTotals>;

// Open loop: every scene in every storage. Closed loop: on the first storage, and on all of them in
// the long form; of A11 at one place.
struct TouchGrid {
    Json open, closed;
    AllTotals closed_totals; // energy that it made, but for edits
};
Result<TouchGrid> touch_grid(const TouchPlan& plan, const TouchParts& parts, const Options& options,
                             Report& report, AllTotals& totals);

// A sum or a largest figure of an algorithm; null where it was asked about no cell.
Json total_of(const AllTotals& totals, const char* algorithm, const char* key);
// The metrics of the plan, each with its gate, what the repaired algorithms reach, and what proves
// it where it is no figure of this run. Null where a part was not run.
Json touch_metrics(const AllTotals& totals, const Json& times, const Json& laws,
                   const Json& z_width);
// Bounds of the repaired algorithms, a row for each, with the names of the worst
// cells.
Json touch_bounds(const AllTotals& totals, const AllTotals& closed);
Json touch_laws(const TouchParts& parts);
// Scenes of bench/touch/family.h; the table is logged, too, as rows of Markdown.
Result<Json> touch_family(const TouchParts& parts, bool held, uint64_t seeds,
                          const std::stop_token& stop);
Json touch_beside(const AllTotals& totals, const Json& times, const Json& z_width);

// How stiff and how damped a wall stays still on each device, with no tick of delay and with one;
// and z_width_<device>_<delay>.png of it.
Result<Json> touch_z_width(const TouchPlan& plan, const Options& options);

} // namespace palpate::bench
