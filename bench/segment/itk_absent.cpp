#include "bench/segment/cases.h"

namespace palpate::bench {

std::optional<ItkRun> itk_filter(const std::string&, const SegmentInput&) {
    return std::nullopt;
}

} // namespace palpate::bench
