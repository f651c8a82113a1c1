#pragma once

#include <array>
#include <glm/glm.hpp>

#include "engine/volume/volume.h"

namespace palpate {

struct SmoothSample {
    double value;        // value units
    glm::dvec3 gradient; // value units per sample, as central_gradient()
};

// A smooth version of the volume, for haptic normals: the samples are blurred with a Gaussian of
// one sample (seven taps on each axis) and approximated by the uniform cubic B-spline, so value and
// gradient are continuous, and the gradient is the derivative of the value.
//
// It reproduces linear fields and it rounds: an edge is blurred by sqrt(4/3) = 1.15 samples, and a
// structure thinner than about two samples fades. Decide inside or outside on trilinear(), and take
// the normal from here. On a tilted plane the normal of central differences errs by degrees, this
// one by tenths (the test SmoothCursor.NormalsOfATiltedPlane has the table).
//
// Border: the volume is continued by its outermost samples. Outside [0, size - 1], and in any cell
// that has a corner without data, value and gradient are NaN; elsewhere samples without data take
// no part and the weights of the others are scaled up.
//
// The cursor keeps the blurred samples of 8x8x8 positions about the last point. Inside them an
// evaluation costs about 0.1 us; leaving them costs about 12 us. It allocates nothing after it is
// made, serves one thread, and keeps the snapshot alive.
class SmoothCursor {
 public:
    explicit SmoothCursor(Volume volume);

    // The result is a function of the point alone, to the bit.
    SmoothSample sample(glm::dvec3 index);

 private:
    static constexpr int kWindow = 8; // blurred samples on each axis
    static constexpr int kReach = 3;  // taps of the Gaussian to each side
    static constexpr int kRead = kWindow + 2 * kReach;

    using Samples = std::array<double, kRead * kRead * kRead>;
    using Blurred = std::array<double, kWindow * kWindow * kWindow>;

    void fill(glm::ivec3 origin);
    void blur(const Samples& in, Blurred& out);

    Volume volume_;
    glm::ivec3 origin_{};    // index of the window's first blurred sample
    bool is_filled_ = false; // the members below belong to origin_
    bool lacks_data_ = false;
    Blurred blurred_{};
    // Scratch of fill():
    Samples samples_{}, weights_{};
    Blurred weight_sums_{};
    std::array<double, kWindow * kRead * kRead> blurred_z_{};
    std::array<double, kWindow * kWindow * kRead> blurred_zy_{};
};

} // namespace palpate
