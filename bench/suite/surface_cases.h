#pragma once

#include "bench/suite/measure.h"
#include "engine/volume/synthetic.h"

namespace palpate::bench {

// A volume and the surface to take from it: of a value, or of all its labels.
struct SurfaceCase {
    Sample sample;
    double iso = 0.0;
    bool labels = false;
    std::optional<synthetic::Field> field; // the truth, where it is known
    bool for_time = false; // so large that only time is measured, and only of who is fast
};

// Whether a part of the suite is asked for: all are where --only names none.
bool is_asked(const Options& options, const std::string& part);

// The volumes that are asked for, made when it is their turn, as some take half a gigabyte. Fails
// where --only names a part that there is not.
struct NamedCase {
    std::string name;
    std::function<Result<SurfaceCase>()> make;
};
Result<std::vector<NamedCase>> surface_cases(const Options& options);

// The parts of the suite that are no volumes, as --only names them.
inline const char* const kEditsPart = "edits";
inline const char* const kWindowPart = "window";
inline const char* const kLivePart = "live";

// The labels that a volume holds but 0, rising.
std::vector<double> labels_in(const Volume& volume);

} // namespace palpate::bench
