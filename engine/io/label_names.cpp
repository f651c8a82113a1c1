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

double linear_of(double encoded) {
    return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}

double root_or_line(double t) { // CIELAB's f
    constexpr double kJoint = 6.0 / 29.0;
    return t > kJoint * kJoint * kJoint ? std::cbrt(t) : t / (3 * kJoint * kJoint) + 4.0 / 29.0;
}

constexpr double kWhiteX = 0.96422, kWhiteZ = 0.82521; // D50

// From XYZ at D50 to linear sRGB, with Bradford's adaptation (brucelindbloom.com). A vector on the
// left takes the rows.
const glm::dmat3 kLinearFromXyz{{3.1338561, -1.6168667, -0.4906146},
                                {-0.9787684, 1.9161415, 0.0334540},
                                {0.0719453, -0.2289914, 1.4052427}};

} // namespace

glm::dvec3 cielab_of_color(glm::dvec3 srgb) {
    const glm::dvec3 linear(linear_of(srgb.x), linear_of(srgb.y), linear_of(srgb.z));
    const glm::dvec3 xyz = linear * glm::inverse(kLinearFromXyz);
    const double x = root_or_line(xyz.x / kWhiteX), y = root_or_line(xyz.y),
                 z = root_or_line(xyz.z / kWhiteZ);
    return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

glm::dvec3 color_of_cielab(glm::dvec3 lab) {
    const double y = (lab.x + 16) / 116;
    const glm::dvec3 d50(kWhiteX, 1.0, kWhiteZ);
    const glm::dvec3 xyz = d50 * glm::dvec3(cube_or_line(y + lab.y / 500), cube_or_line(y),
                                            cube_or_line(y - lab.z / 200));
    const glm::dvec3 linear = xyz * kLinearFromXyz;
    return {encoded(linear.x), encoded(linear.y), encoded(linear.z)};
}

} // namespace palpate
