#pragma once

#include "engine/segment/brick_maker.h"

namespace palpate {

// Refuses a result whose grid a person has chosen in the place of that of `from`, where it has more
// samples and needs more memory, beside `from`, than `limit_bytes` (expect_memory()).
Result<void> expect_result_memory(const BrickMaker& maker, const Volume& from,
                                  uint64_t limit_bytes);

} // namespace palpate
