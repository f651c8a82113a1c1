#pragma once

#include <span>

#include "bench/suite/measure.h"
#include "bench/suite/subject.h"

namespace palpate::bench {

// The cost of a frame of two eyes beside one of one eye; and, from the subject's camera turned by
// each of some angles, the cost and the error of a frame from fewer rays beside one of full
// quality. Ratios of frames drawn one after the other, `pairs` times (>= 1), fewer where the
// short form is late; appends their aims. Fails where a frame cannot be drawn, and when
// interrupted.
Result<Json> measure_relative(Bench& bench, const Subject& subject, uint32_t size_px, int pairs,
                              std::span<const double> turned_degrees, Json& aims);

} // namespace palpate::bench
