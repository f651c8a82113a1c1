#pragma once

#include <optional>

#include "engine/volume/volume.h"

namespace palpate {

// Statistics of a volume's values, from which default pictures are chosen.
//
// Made from a regular subset of the samples, the same one every time: about 10^5 voxels with their
// neighbours, and every sample along at most 48 x 48 grid lines of each axis. No-data counts
// nowhere. A value counts as an outlier where it lies four times as far out as any value that two
// samples in a row reach, so that the window without it has at least a quarter of its greys.
struct ValueSurvey {
    // The values of interest lie between these; low < high. `low` is the value below which 1 % of
    // the voxels lie or, where it is higher, the background: the one value that at least a fifth of
    // all voxels have, with ten times as many above it as below. 0.5 % of the voxels above `low`
    // lie above `high`, outliers apart. Where the background is bright, all of this is turned over:
    // `high` is the background, and 0.5 % of the voxels below it lie below `low`.
    double low = 0.0, high = 1.0;

    // 95 % of the maxima along grid lines lie below it, counting those that rise above `low` by 5 %
    // of the way to the highest 0.1 %. > low; outliers apart.
    double projected_high = 1.0;
    // The same of the minima, downwards from `high`, if the background is bright. < high.
    double projected_low = 0.0;

    // The median along the twelve edges of the box of samples, where ten times as many voxels are
    // darker than what noise makes of it (three interquartile ranges) as are brighter.
    std::optional<double> bright_background;

    double lower_percent = 0.0; // 1 % of the voxels lie below it
    double upper_quarter = 0.0; // 75 % do

    // Whether the values are spread as the Hounsfield units of a body with air in or about it are.
    // Four things must hold. At least 1 % of the voxels lie within -1100 .. -700, where air and
    // lungs are. There are twice as many of them as within -650 .. -250, where nothing but the
    // rims of a body lies. So are there within -200 .. 200, where fat, water and muscle are. These
    // are at least 40 % of all voxels above -250, and `high` is above 0 and below 4000, where metal
    // ends. Values below -1100 do not count: padding lies there.
    bool like_hounsfield = false;

    // The share of equal pairs among neighbouring voxels along x, y and z that are both not 0.
    double equal_neighbours = 0.0;
};

ValueSurvey survey_values(const Volume& volume);

// Numbers of labels rather than grey values: u8 or u16 with a background of 0, and neighbours are
// equal nearly everywhere.
bool looks_like_labels(const Volume& volume, const ValueSurvey& survey);

} // namespace palpate
