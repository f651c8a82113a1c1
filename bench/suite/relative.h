#pragma once

#include <span>

#include "bench/suite/measure.h"
#include "bench/suite/subject.h"

namespace palpate::bench {

// What a frame of two eyes costs beside one of one eye, and, from the subject's camera turned by
// each of some angles, how much faster a frame from fewer rays is than one of full quality, beside
// its error. Ratios of frames drawn one after the other, `pairs` times (>= 1), fewer where the
// short form is late; appends their aims. Fails where a frame cannot be drawn, and when
// interrupted.
Result<Value> measure_relative(Bench& bench, const Subject& subject, uint32_t size_px, int pairs,
                               std::span<const double> turned_degrees, Value& aims);

} // namespace palpate::bench
