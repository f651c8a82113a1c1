#pragma once

#include "engine/segment/task.h"
#include "engine/volume/volume.h"

namespace palpate {

struct ValueInterval {
    double low = 0.0, high = 0.0; // both ends belong to it
};

// Label 1 where the value lies in the interval, 0 elsewhere and where there is no data: u8 on the
// volume's grid (the global method of Vidholm & Agmund 2004, section 4.3.4).
Result<Volume> threshold_labels(const Volume& volume, ValueInterval interval, const Task& task);

} // namespace palpate
