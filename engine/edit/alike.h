#pragma once

#include <optional>
#include <stop_token>
#include <vector>

#include "engine/edit/sample_mask.h"
#include "engine/edit/sweep.h"
#include "engine/volume/volume.h"

namespace palpate {

// The rule of the edge-aware brush (Operation::alike): of a tool that stands still only the samples
// that are connected to the one at its origin, and alike.
constexpr int kAlikeReach = 2; // samples
struct AlikeRange {
    double low, high; // grey values, both ends included
    bool has(double value) const { return value >= low && value <= high; }
};

// Values alike those around a point: m - k s to m + k s, where m is the median of the samples that
// are at most kAlikeReach away, on each axis, from the sample nearest to the point, and s is 1.4826
// times the median of their distances from m. The median of an even number of values is the mean of
// the two in the middle; samples without data do not count. 1.4826: s is then the standard
// deviation of values with a normal distribution; of 125 such values it is good to a tenth (the
// relative error is 1 / sqrt(2 * 0.37 * 125), 0.37 being the estimate's efficiency). Nothing: the
// point lies in no sample's cell, or no sample has data.
AlikeRange alike_range(std::vector<double> values, double deviations); // of at least one value
std::optional<AlikeRange> alike_around(const Volume& greys, glm::dvec3 point_mm, double deviations);

// The samples that a tool at a pose holds and that are alike and connected, by faces and through
// such samples alone, to the sample nearest to its origin, by bricks. That sample counts as held,
// so that a tool smaller than a sample still leaves a trace. None where it is not alike.
struct BrickSamplesHeld {
    glm::uvec3 brick;
    SampleMask samples;
};
std::vector<BrickSamplesHeld> alike_and_connected(const Volume& greys, const Tool& tool,
                                                  const StrokePose& pose, const AlikeRange& range,
                                                  const std::stop_token& stop = {});

// The poses at which a tool on its way is looked at: from the first behind `from` to `to` itself,
// as few equal parts as have no point of the tool move by more than the smallest spacing. Those
// whose origin lies in no sample's cell are left out.
std::vector<StrokePose> dabs_between(const Tool& tool, const Grid& grid, const StrokePose& from,
                                     const StrokePose& to);

} // namespace palpate
