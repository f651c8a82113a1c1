#pragma once

#include "bench/suite/measure.h"

namespace palpate::bench {

// The factorial experiment: what each choice costs, and what error it brings. First every factor
// is moved alone from a default; then `hypercube` settings are drawn in which all factors move at
// once, each level equally often (Latin hypercube), and the geometric means of time and error over
// the settings of a level are held against those over all.
Result<Json> factors_json(Bench& bench, uint32_t hypercube);

} // namespace palpate::bench
