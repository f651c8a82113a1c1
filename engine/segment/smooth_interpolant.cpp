#include "engine/segment/smooth_interpolant.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "engine/base/assert.h"

namespace palpate {

namespace {

// Solves a x = b in place by elimination with pivots from the rows; a by rows.
void solve(std::vector<double>& a, std::vector<double>& b) {
    const size_t n = b.size();
    for (size_t k = 0; k < n; ++k) {
        size_t pivot = k;
        for (size_t i = k + 1; i < n; ++i)
            if (std::abs(a[i * n + k]) > std::abs(a[pivot * n + k]))
                pivot = i;
        PALPATE_ASSERT(a[pivot * n + k] != 0.0);
        if (pivot != k) {
            std::swap_ranges(a.begin() + ptrdiff_t(k * n), a.begin() + ptrdiff_t(k * n + n),
                             a.begin() + ptrdiff_t(pivot * n));
            std::swap(b[k], b[pivot]);
        }
        const double* const from = &a[k * n];
        tbb::parallel_for(tbb::blocked_range<size_t>(k + 1, n, 64),
                          [&](const tbb::blocked_range<size_t>& rows) {
                              for (size_t i = rows.begin(); i < rows.end(); ++i) {
                                  double* const row = &a[i * n];
                                  const double share = row[k] / from[k];
                                  for (size_t j = k + 1; j < n; ++j)
                                      row[j] -= share * from[j];
                                  b[i] -= share * b[k];
                              }
                          });
    }
    for (size_t k = n; k-- > 0;) {
        for (size_t j = k + 1; j < n; ++j)
            b[k] -= a[k * n + j] * b[j];
        b[k] /= a[k * n + k];
    }
}

} // namespace

SmoothInterpolant::SmoothInterpolant(std::span<const glm::dvec3> places,
                                     std::span<const double> values)
    : weights_(values.begin(), values.end()) {
    PALPATE_ASSERT_CMP(places.size(), ==, values.size());
    for (const glm::dvec3 p : places)
        center_ += p / double(places.size());
    double largest = 0.0;
    for (const glm::dvec3 p : places)
        largest = std::max(largest, glm::distance(p, center_));
    scale_ = largest > 0.0 ? 1.0 / largest : 1.0;
    for (const glm::dvec3 p : places)
        places_.push_back(scale_ * (p - center_));
    const size_t count = places_.size(), n = count + 4;
    std::vector<double> rows(n * n, 0.0);
    for (size_t i = 0; i < count; ++i) {
        for (size_t k = 0; k < count; ++k) {
            const double r = glm::distance(places_[i], places_[k]);
            rows[i * n + k] = r * r * r;
        }
        const double linear[] = {1.0, places_[i].x, places_[i].y, places_[i].z};
        for (size_t k = 0; k < 4; ++k)
            rows[i * n + count + k] = rows[(count + k) * n + i] = linear[k];
    }
    weights_.resize(n, 0.0);
    solve(rows, weights_);
}

double SmoothInterpolant::operator()(glm::dvec3 at) const {
    const glm::dvec3 p = scale_ * (at - center_);
    const size_t count = places_.size();
    double sum = weights_[count] + weights_[count + 1] * p.x + weights_[count + 2] * p.y +
                 weights_[count + 3] * p.z;
    for (size_t i = 0; i < count; ++i) {
        const glm::dvec3 off = p - places_[i];
        const double squared = glm::dot(off, off);
        sum += weights_[i] * squared * std::sqrt(squared);
    }
    return sum;
}

} // namespace palpate
