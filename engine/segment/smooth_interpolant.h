#pragma once

#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace palpate {

// The smoothest function of space that has given values at given places: the sum of w |x - p|^3
// over the places p, and a linear function (Duchon 1977; as an implicit surface through curves:
// Turk & O'Brien, "Shape transformation using variational implicit functions", 1999). Of all that
// have the values it has the least sum of squared third derivatives, and so no bend of its own
// between them.
//
// Places must differ, and not lie in one plane. Work: n^3 / 3 multiplications for n places, n for a
// value; memory 8 n^2 bytes while it is made.
class SmoothInterpolant {
 public:
    SmoothInterpolant(std::span<const glm::dvec3> places, std::span<const double> values);
    double operator()(glm::dvec3 at) const;

 private:
    glm::dvec3 center_{0.0};
    double scale_ = 1.0; // of lengths, so that all are about 1
    std::vector<glm::dvec3> places_;
    std::vector<double> weights_; // and then those of 1, x, y, z
};

} // namespace palpate
