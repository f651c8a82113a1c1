#include "apps/view/document/segment_times.h"

#include <algorithm>
#include <string_view>
#include <utility>

namespace palpate::view {

namespace {

// Seconds of a core for 10^6 samples: `palpate segment` on the trunk CT of the guide, 1.38 x 10^6
// samples, from three balls of seeds, one of them outside.
constexpr std::pair<std::string_view, double> kMeasured[] = {
    {"threshold", 0.03},          {"otsu", 0.03},           {"region-growing", 0.4},
    {"watershed", 0.2},           {"fast-marching", 1.2},   {"fast-marching-edges", 0.8},
    {"fuzzy-connectedness", 0.6}, {"random-walker", 140.0}, {"grow-from-seeds", 0.3},
    {"level-set", 1.5},           {"level-set-edges", 7.2}, {"level-set-regions", 1.6}};

} // namespace

double SegmentTimes::expected_s(const std::string& method, uint64_t samples) const {
    const auto own = seconds_per_sample_.find(method);
    if (own != seconds_per_sample_.end())
        return own->second * static_cast<double>(samples);
    const auto* const measured =
        std::ranges::find(kMeasured, method, &std::pair<std::string_view, double>::first);
    return measured == std::end(kMeasured) ? 0.0
                                           : measured->second * 1e-6 * static_cast<double>(samples);
}

void SegmentTimes::note(const std::string& method, uint64_t samples, double seconds) {
    if (samples > 0)
        seconds_per_sample_[method] = seconds / static_cast<double>(samples);
}

} // namespace palpate::view
