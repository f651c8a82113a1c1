#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace palpate::view {

// How long methods of segmentation take on so many samples, before they have begun: by the last run
// of this window, else as they took once on a core of a server. The data decide what is to be done,
// so that a run may take several times as long, or a part of it. 0: not known.
class SegmentTimes {
 public:
    double expected_s(const std::string& method, uint64_t samples) const;
    void note(const std::string& method, uint64_t samples, double seconds); // of a run that ended

 private:
    std::map<std::string, double> seconds_per_sample_; // of runs of this window
};

} // namespace palpate::view
