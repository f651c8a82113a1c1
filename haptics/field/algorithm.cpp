#include "haptics/field/algorithm.h"

#include <algorithm>
#include <cmath>

namespace palpate::haptics {

double strength_n(const HapticTransfer& t, double value) {
    if (t.point_count > 0) {
        const uint32_t count = std::min(t.point_count, HapticTransfer::kMostPoints);
        uint32_t next = 0;
        while (next < count && t.values[next] <= value)
            ++next;
        if (next == 0 || next == count)
            return t.forces_n[next == 0 ? 0 : count - 1];
        const double share = (value - t.values[next - 1]) / (t.values[next] - t.values[next - 1]);
        return t.forces_n[next - 1] + share * (t.forces_n[next] - t.forces_n[next - 1]);
    }
    if (t.width == 0.0)
        return t.strength_n;
    return t.strength_n / (1.0 + std::exp(-(value - t.center) / t.width));
}

} // namespace palpate::haptics
