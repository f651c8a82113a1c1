#include "engine/segment/threshold.h"

#include "engine/segment/map_values.h"

namespace palpate {

Result<Volume> threshold_labels(const Volume& volume, ValueInterval interval, const Task& task) {
    return map_values<uint8_t>(std::array{&volume}, task, [&](std::array<float, 1> v) {
        return uint8_t(v[0] >= interval.low && v[0] <= interval.high);
    });
}

} // namespace palpate
