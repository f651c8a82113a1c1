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
};
constexpr double kGrowthRatio = 1.0905077326652577; // 2^(1/8)

// Samples whose arrival is 0 or below are seeds. Memory: 4 bytes a sample that arrived.
Result<ArrivalGrowth> arrival_growth(const Volume& arrival, const Task& task);

// The repaired rule: the time at which the front lies on the clearest boundary.
//
// The front at time T is the faces between samples that have arrived by T and neighbours that have
// not. Its contrast is the mean, by area, of the logarithm of the cost beyond over the cost within.
// A front that lies on a boundary everywhere has the largest contrast: before, a part of it crosses
// the object, and after a leak a part crosses what lies around. Region growing by such a measure:
// Hojjatoleslami & Kittler, "Region growing: a new approach", 1998.
//
// This finds the boundary, but the foot of its edge: a cost of 0.01 becomes one of 0.1. The front
// goes on, by kEdgeLayers layers of samples at most, to where the mean rise of log(1 + cost) is
// largest, as values there are about as far off as costs of 1 say; and from there by a layer at
// most to where the mean difference of values across it is largest. It does so as long as it grows
// evenly: the area of a convex body that grows by layers grows at most as its volume to the power
// of 2/3 (Minkowski: area^2 >= 3 volume * integral of the mean curvature); where it grows faster,
// by kEven for the lattice, the front leaks.
//
// A front of few faces says little: its contrast counts as if kNoContrast faces without contrast
// were added. Absent where the cost rises by less than a factor of e across every front: it has met
// no boundary, and a person must choose. Of equal times the first. `values`: what the object is
// seen in, on the grid of arrival and cost. The number of threads changes no bit.
constexpr double kEdgeLayers = 3.0, kEven = 1.2;
constexpr double kNoContrast = 50.0;
Result<std::optional<double>> boundary_time(const Volume& arrival, const Volume& cost,
                                            const Volume& values, const Task& task);

// The rule as printed: "found by analysis of the average cost of the narrow band points during
// propagation" (Nystroem et al. 2008, section 4). The print says no more; here it is read thus: the
// narrow band at time T are the samples of arrival (T / kGrowthRatio, T], and the front stops when
// their mean cost first exceeds `factor` times that of the first band. It leaks where an object is
// not homogeneous, or stops early where seeds are of the most homogeneous part.
// Absent where no band exceeds it.
Result<std::optional<double>> band_cost_time(const Volume& arrival, const Volume& cost,
                                             double factor, const Task& task);

} // namespace palpate
