#pragma once

#include <span>

namespace palpate::haptics {

// Grey values far from the surface, on its free and on its solid side; equal where not known.
struct Plateaus {
    double free = 0.0, solid = 0.0;

    friend bool operator==(const Plateaus&, const Plateaus&) = default;
};

// Those that a step can be straightened with: where the surface lies well within it, and normals
// are not blurred, for noise would be raised. Else none.
Plateaus usable_plateaus(Plateaus plateaus, double iso, double blur_samples);

// The stored form of a sample: a float that rises with the sample and is 0 at `base`, so that
// rounding is least where the surface lies.
//
//   labels        0.5 in a label and -0.5 outside
//   straightened  the blurred step between the plateaus becomes a wider one, as steep at the base
//                 as the samples are: the quantile of the sample's share of the step is how far the
//                 surface is, and a step of 1.6 times the blur is made of that
//   else          the sample less the base
class StoredSamples {
 public:
    StoredSamples();
    // Plateaus without the base between them are not used (usable_plateaus() asks for more).
    void set(bool labels, double base, Plateaus plateaus);

    float of(float sample) const;
    void make(std::span<float> samples) const; // of() of each, in place
    bool labels() const { return labels_; }
    bool straightened() const { return straightened_; }
    double base() const { return base_; }
    // Of straightened steps: from here on a stored sample no longer tells how far the surface is.
    float buried() const { return buried_; }

 private:
    bool labels_ = false, straightened_ = false;
    double base_ = 0.5;
    float free_ = 0.0f, share_scale_ = 0.0f, step_scale_ = 0.0f, step_at_base_ = 0.0f;
    float buried_ = 0.0f;
};

} // namespace palpate::haptics
