#pragma once

#include "bench/study/simulated_user.h"

namespace palpate::bench {

// How people differ who outline an object slice by slice: each drawn line is off the true one by a
// wave whose standard deviation is off_sd_mm and whose lengths are 20 to 60 mm, which goes over
// into another one within a few slices. The deviation is an assumption, measured on nobody.
struct OutlineHabits {
    double off_sd_mm = 2.0;
};

struct Outlined {
    Volume labels;           // u8, 0 and 1, on the grid of the truth
    Interaction interaction; // two clicks a slice, and the length of the lines
};
// A function of truth, seed and habits. The slices are those of the third axis.
Result<Outlined> outline_by_hand(const Volume& truth, uint64_t seed, const OutlineHabits& habits,
                                 const Task& task);

} // namespace palpate::bench
