#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/base/json.h"
#include "engine/segment/task.h"
#include "engine/volume/volume.h"

// Methods that divide a volume among seeds of several labels, on the same simulated seeds: Dice
// beside time.
namespace palpate::bench {

struct SeedsCase {
    std::string name;
    Volume volume, truth;         // on one grid
    std::vector<uint16_t> labels; // of the truth; all others are background
    double radius_mm = 8.0;       // of seeds
};

struct SeedsOptions {
    std::vector<SeedsCase> cases;
    uint32_t balls = 3;      // of a label
    uint32_t outside = 20;   // of the background
    uint32_t users = 2;      // sets of seeds a case
    uint64_t first_user = 1; // their numbers; those below 100 were looked at for parameters
    double longest_s = 60.0; // of processors: a method that takes longer is stopped
    std::vector<std::string> methods{"grow-from-seeds", "watershed", "fuzzy-connectedness",
                                     "random-walker"};
    std::filesystem::path keep{}; // a folder for volumes, truths and seeds; empty: none
};

// "rows", one a case and method: "dice" (mean over labels and users, and the worst label of any
// user), "wall_s" and "cpu_s" (medians), "stopped" (runs that took too long, which count in no
// figure).
Result<Json> seeds_study(const SeedsOptions& options, const Task& task);

// Times of forests of large volumes with noise everywhere, which no method likes: a row each of
// samples, labels, seconds fresh and of updates, bytes a sample held, and the most of the process.
Result<Json> seeds_times(bool with_largest, const Task& task);

} // namespace palpate::bench
