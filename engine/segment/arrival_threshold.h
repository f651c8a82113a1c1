#pragma once

#include <optional>
#include <vector>

#include "engine/segment/task.h"
#include "engine/volume/volume.h"

// When to stop a front: the threshold of arrival times that bounds an object.
namespace palpate {

// How a volume grows with time: samples that have arrived by each time. Times are spaced evenly in
// their logarithm, from when half as many samples again as the seeds cover have arrived, to when
// the last one has.
struct ArrivalGrowth {
    std::vector<double> times;  // ascending, each kGrowthRatio times the one before
    std::vector<double> counts; // of samples that arrived by then
    // d log count / d log time between this time and the next, smoothed; one fewer than times.
    std::vector<double> rates;
};
constexpr double kGrowthRatio = 1.0905077326652577; // 2^(1/8)

// Samples whose arrival is 0 or below are seeds. Memory: 4 bytes a sample that arrived.
Result<ArrivalGrowth> arrival_growth(const Volume& arrival, const Task& task);

// The repaired rule: the first time at which growth is slowest behind its first fastest.
//
// In a homogeneous object a front gains volume as a power of time, up to the third. Where it meets
// the boundary on most sides the power falls, and beyond, in what lies around, it rises again: a
// boundary is a minimum of the power, whatever the scale of the cost. A minimum counts where the
// power has fallen by kTurn of the greatest before it, while the volume has grown kGrown times, and
// rises by kTurn of itself after it. Near the seeds the layers of the lattice make the power go up
// and down, but within less growth. Absent where there is no minimum: the front has met no
// boundary, and a person must choose.
constexpr double kTurn = 0.1, kGrown = 1.5;
std::optional<double> boundary_time(const ArrivalGrowth& growth);

// The rule as printed: "found by analysis of the average cost of the narrow band points during
// propagation" (Nystroem et al. 2008, section 4). The print says no more; here it is read thus: the
// narrow band at time T are the samples of arrival (T / kGrowthRatio, T], and the front stops when
// their mean cost first exceeds `factor` times that of the first band. It leaks where an object is
// not homogeneous, or stops early where seeds are of the most homogeneous part.
// Absent where no band exceeds it.
Result<std::optional<double>> band_cost_time(const Volume& arrival, const Volume& cost,
                                             double factor, const Task& task);

} // namespace palpate
