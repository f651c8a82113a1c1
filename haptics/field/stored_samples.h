#pragma once

#include <span>

namespace palpate::haptics {

// The stored form of a sample: a float that rises with the sample and is 0 at `base`, so that
// rounding is least where the surface lies. Of labels, 0.5 in a label and -0.5 outside; else the
// sample less the base.
class StoredSamples {
 public:
    void set(bool labels, double base);

    float of(float sample) const {
        return labels_ ? (sample > 0.0f ? 0.5f : -0.5f) : sample - base_;
    }
    void make(std::span<float> samples) const; // of() of each, in place

 private:
    bool labels_ = false;
    float base_ = 0.5f;
};

} // namespace palpate::haptics
