#include "haptics/field/stored_samples.h"

#include "haptics/field/four.h"

namespace palpate::haptics {

void StoredSamples::set(bool labels, double base) {
    labels_ = labels;
    base_ = static_cast<float>(base);
}

void StoredSamples::make(std::span<float> samples) const {
    size_t i = 0;
    if (!labels_) // the common case, four at a time
        for (; i + 4 <= samples.size(); i += 4)
            store(&samples[i], load(&samples[i]) - Four{base_, base_, base_, base_});
    for (; i < samples.size(); ++i)
        samples[i] = of(samples[i]);
}

} // namespace palpate::haptics
