#pragma once

#include "engine/segment/task.h"
#include "engine/volume/volume.h"

namespace palpate {

struct RandomWalkerOptions {
    double sd = 1.0;         // standard deviation of differences within an object, value units, > 0
    double tolerance = 1e-4; // largest change of a probability in the last sweep, > 0
    int most_sweeps = 5000;  // >= 1
};

// Probability that a walker which starts at a sample meets a seed of `label` before one of another
// label (Grady, Random walks for image segmentation, 2006). It steps to a neighbour with a common
// face with a weight of exp(-(a - b)^2 / (2 sd^2)) / h^2, a and b their values and h their distance
// in mm; at least 1e-6 / h^2. So it crosses edges seldom, and a weak edge between strong ones holds
// it, which a front leaks through.
//
// f32, 0 .. 1; exactly 0 where no seed of the label can be reached; no data where the volume has
// none. The linear equations are solved by red and black successive over-relaxation from 0, in
// bricks on all threads: the number of threads changes no bit. The error is above the tolerance, by
// up to about the number of samples across. Weights come from a table of 256 steps a standard
// deviation. Grids whose axes are at right angles; others are refused. Memory: 10.8 bytes a sample
// beside volume and result.
//
// Refused: seeds of another size, no seed of the label, fewer than two labels of seeds.
Result<Volume> random_walker(const Volume& volume, const Volume& seeds, uint16_t label,
                             const RandomWalkerOptions& options, const Task& task);

} // namespace palpate
