#include "engine/io/label_names.h"

#include <cmath>

namespace palpate {

namespace {

double cube_or_line(double t) { // the inverse of CIELAB's f
    constexpr double kJoint = 6.0 / 29.0;
    return t > kJoint ? t * t * t : 3 * kJoint * kJoint * (t - 4.0 / 29.0);
}

double encoded(double linear) { // IEC 61966-2-1
    linear = std::fmin(std::fmax(linear, 0.0), 1.0);
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

} // namespace

glm::dvec3 color_of_cielab(glm::dvec3 lab) {
    const double y = (lab.x + 16) / 116;
    const glm::dvec3 d50(0.96422, 1.0, 0.82521);
    const glm::dvec3 xyz = d50 * glm::dvec3(cube_or_line(y + lab.y / 500), cube_or_line(y),
                                            cube_or_line(y - lab.z / 200));
    // From XYZ at D50 to linear sRGB, with Bradford's adaptation (brucelindbloom.com).
    const glm::dmat3 rows{{3.1338561, -1.6168667, -0.4906146},
                          {-0.9787684, 1.9161415, 0.0334540},
                          {0.0719453, -0.2289914, 1.4052427}};
    const glm::dvec3 linear = xyz * rows; // a vector on the left takes the rows
    return {encoded(linear.x), encoded(linear.y), encoded(linear.z)};
}

} // namespace palpate
