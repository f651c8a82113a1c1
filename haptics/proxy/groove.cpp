#include "haptics/proxy/groove.h"

#include <algorithm>
#include <cmath>

namespace palpate::haptics {

namespace {

using glm::dmat3;
using glm::dvec3;

// What a normal errs by: the sine of 2 degrees.
constexpr double kTilt = 0.035;
// Mean squares of the normals' components across a groove: from the first on they count as spread,
// from the second on they certainly are. Those across a groove of 150 degrees have 0.023.
constexpr double kSpread = 0.004, kSpreadSurely = 0.016;

// Near the surface 1, at `reach` and beyond 0; and 0 where the ball does not face the surface,
// which then bends away from it.
double weight_of(const Hold& hold, double reach_mm) {
    const double share = hold.clearance_mm / reach_mm;
    return hold.faces * std::max(0.0, 1.0 - share * share);
}

// The unit vector that a positive definite matrix makes least of: inverse iteration, from the
// longest column of the inverse.
dvec3 least_of(const dmat3& matrix) {
    const dmat3 inverse = glm::inverse(matrix);
    dvec3 least = inverse[0];
    for (int k = 1; k < 3; ++k)
        if (glm::length(inverse[k]) > glm::length(least))
            least = inverse[k];
    for (int k = 0; k < 5; ++k)
        least = glm::normalize(inverse * glm::normalize(least));
    return least;
}

} // namespace

dvec3 Groove::normal_at(double angle_rad) const {
    return std::cos(angle_rad) * out + std::sin(angle_rad) * across;
}

double Groove::angle_rad_of(dvec3 normal) const {
    return std::atan2(glm::dot(normal, across), glm::dot(normal, out));
}

Groove groove_of(std::span<const Hold> holds, double reach_mm) {
    dmat3 squares(0.0); // the sum of n n^T, whose trace is the sum of weights
    dvec3 mean(0.0);
    double total = 0.0;
    for (const Hold& hold : holds) {
        const double weight = weight_of(hold, reach_mm);
        squares += weight * glm::outerProduct(hold.normal, hold.normal);
        mean += weight * hold.normal;
        total += weight;
    }
    Groove groove;
    if (!(total > 0.0))
        return groove;
    squares = squares * (1.0 / total) + dmat3(1e-9);
    groove.along = least_of(squares);
    // Its eigenvalues: the least, and of the other two the lesser.
    const double least = std::max(glm::dot(groove.along, squares * groove.along), 1e-12);
    const double sum = 1.0 - least, product = glm::determinant(squares) / least;
    const double spread = 0.5 * (sum - std::sqrt(std::max(0.0, sum * sum - 4.0 * product)));
    mean -= glm::dot(mean, groove.along) * groove.along;
    if (spread < kSpread || !(glm::length(mean) > 1e-3 * total))
        return groove;
    groove.certainty = std::min(1.0, (spread - kSpread) / (kSpreadSurely - kSpread)) * kTilt *
                       kTilt / (kTilt * kTilt + least);
    groove.out = glm::normalize(mean);
    groove.across = glm::cross(groove.along, groove.out);
    for (const Hold& hold : holds)
        if (weight_of(hold, reach_mm) > 0.0) {
            groove.low_rad = std::min(groove.low_rad, groove.angle_rad_of(hold.normal));
            groove.high_rad = std::max(groove.high_rad, groove.angle_rad_of(hold.normal));
        }
    return groove;
}

double agree(const Groove& groove, std::span<Hold> holds, double reach_mm, double error_mm) {
    if (!(groove.certainty > 0.0))
        return 0.0;
    dmat3 squares(1e-3);
    dvec3 sums(0.0);
    double total = 0.0;
    for (Hold& hold : holds) {
        const double weight = weight_of(hold, reach_mm);
        if (weight == 0.0)
            continue;
        const double leans = groove.certainty * weight * glm::dot(hold.normal, groove.along);
        hold.normal = glm::normalize(hold.normal - leans * groove.along);
        squares += weight * glm::outerProduct(hold.normal, hold.normal);
        sums += weight * hold.clearance_mm * hold.normal;
        total += weight;
    }
    if (!(total > 0.0))
        return 0.0;
    const dvec3 place = glm::inverse(squares) * sums;
    const auto apart = [&](const Hold& hold) {
        return hold.clearance_mm - glm::dot(hold.normal, place);
    };
    double left = 0.0;
    for (const Hold& hold : holds)
        left += weight_of(hold, reach_mm) * apart(hold) * apart(hold);
    const double share =
        groove.certainty * error_mm * error_mm / (error_mm * error_mm + left / total);
    for (Hold& hold : holds)
        hold.clearance_mm -= share * weight_of(hold, reach_mm) * apart(hold);
    return share;
}

} // namespace palpate::haptics
