#pragma once

#include "bench/suite/measure.h"
#include "bench/suite/subject.h"

namespace palpate::bench {

// What a frame of two eyes costs beside one of one eye, and how much faster one from fewer rays is
// than one of full quality, beside its error. Ratios of frames drawn one after another; appends
// their aims.
Result<Value> measure_relative(Bench& bench, const Subject& subject, uint32_t size_px, int rounds,
                               Value& aims);

} // namespace palpate::bench
