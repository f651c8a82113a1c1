#pragma once

#include "engine/volume/volume.h"

namespace palpate {

// Statistics of a volume's values, from which default pictures are chosen.
//
// Made from a regular subset of the samples, the same one every time: about 10^5 voxels, and every
// sample along at most 48 x 48 grid lines of each axis. No-data counts nowhere.
struct ValueSurvey {
    // Where the values of interest begin and end; low < high. `low` is the value below which 1 % of
    // the voxels lie or, where it is higher, the one value that at least a fifth of all voxels have
    // and no more than half of them lie below (the background). 0.5 % of the voxels above `low` lie
    // above `high`.
    double low = 0.0, high = 1.0;

    // Of the maxima along grid lines, those that rise above `low` by 5 % of the way to the highest
    // 0.1 %: the value that 95 % of them lie below. > low.
    double projected_high = 1.0;

    double lower_percent = 0.0; // 1 % of the voxels lie below it
    double upper_quarter = 0.0; // 75 % do

    // Of neighbouring voxels along x, y and z that are both not 0: the share that are equal.
    double equal_neighbours = 0.0;
};

ValueSurvey survey_values(const Volume& volume);

// Numbers of labels rather than grey values: u8 or u16 with a background of 0, and neighbours are
// equal nearly everywhere.
bool looks_like_labels(const Volume& volume, const ValueSurvey& survey);

} // namespace palpate
