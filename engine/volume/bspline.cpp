#include "engine/volume/bspline.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/volume/box.h"
#include "engine/volume/cubic_weights.h"
#include "engine/volume/sample.h"

namespace palpate {

namespace {

// exp(-k^2 / 2), k = -3 .. 3, divided by their sum. Numbers, so that no bit depends on a library.
constexpr std::array<double, 7> gaussian_taps() {
    constexpr double e1 = 0.60653065971263342, e2 = 0.13533528323661270, e3 = 0.01110899653824231;
    constexpr double sum = 1.0 + 2.0 * (e1 + e2 + e3);
    return {e3 / sum, e2 / sum, e1 / sum, 1.0 / sum, e1 / sum, e2 / sum, e3 / sum};
}
constexpr std::array<double, 7> kTaps = gaussian_taps();

double dot4(const std::array<double, 4>& w, const double* c) {
    return w[0] * c[0] + w[1] * c[1] + w[2] * c[2] + w[3] * c[3];
}

} // namespace

SmoothCursor::SmoothCursor(Volume volume) : volume_(std::move(volume)) {}

SmoothSample SmoothCursor::sample(glm::dvec3 index) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    const glm::dvec3 last = glm::dvec3(volume_.size()) - 1.0;
    for (int axis = 0; axis < 3; ++axis)
        if (!(index[axis] >= 0.0 && index[axis] <= last[axis]))
            return {nan, glm::dvec3(nan)};

    const glm::dvec3 low = glm::floor(index);
    const glm::ivec3 first = glm::ivec3(low) - 1;
    const glm::ivec3 in_window = first - origin_;
    if (!is_filled_ || glm::any(glm::lessThan(in_window, glm::ivec3(0))) ||
        glm::any(glm::greaterThan(in_window, glm::ivec3(kWindow - 4))))
        fill(first - (kWindow - 4) / 2);
    if (lacks_data_ && std::isnan(trilinear(volume_, index)))
        return {nan, glm::dvec3(nan)};

    const glm::dvec3 f = index - low;
    const CubicWeights<double> x = cubic_weights(f.x), y = cubic_weights(f.y),
                               z = cubic_weights(f.z);
    const glm::ivec3 at = first - origin_;
    std::array<double, 4> plane{}, plane_dx{}, plane_dy{};
    for (int k = 0; k < 4; ++k) {
        std::array<double, 4> row{}, row_dx{};
        for (int j = 0; j < 4; ++j) {
            const double* c =
                &blurred_[static_cast<size_t>(at.x + kWindow * (at.y + j + kWindow * (at.z + k)))];
            row[j] = dot4(x.value, c);
            row_dx[j] = dot4(x.slope, c);
        }
        plane[k] = dot4(y.value, row.data());
        plane_dx[k] = dot4(y.value, row_dx.data());
        plane_dy[k] = dot4(y.slope, row.data());
    }
    return {dot4(z.value, plane.data()),
            {dot4(z.value, plane_dx.data()), dot4(z.value, plane_dy.data()),
             dot4(z.slope, plane.data())}};
}

void SmoothCursor::fill(glm::ivec3 origin) {
    origin_ = origin;
    is_filled_ = true;
    read_box(volume_, origin_ - kReach, glm::ivec3(kRead), packed(glm::uvec3(kRead)),
             samples_.data());
    lacks_data_ = std::any_of(samples_.begin(), samples_.end(), [](double v) { return v != v; });
    if (!lacks_data_) {
        blur(samples_, blurred_);
        return;
    }
    for (size_t i = 0; i < samples_.size(); ++i) {
        weights_[i] = std::isnan(samples_[i]) ? 0.0 : 1.0;
        samples_[i] = std::isnan(samples_[i]) ? 0.0 : samples_[i];
    }
    blur(samples_, blurred_);
    blur(weights_, weight_sums_);
    // A cell with data at its corners uses no blurred sample whose weights are all zero.
    for (size_t i = 0; i < blurred_.size(); ++i)
        blurred_[i] = weight_sums_[i] > 0.0 ? blurred_[i] / weight_sums_[i] : 0.0;
}

namespace {

// One axis of the blur: kRun values lie between neighbours on it, and kOuter such slabs follow.
template <int kWindow, int kRead, int kOuter, int kRun>
void blur_axis(const double* from, double* to) {
    for (int outer = 0; outer < kOuter; ++outer)
        for (int i = 0; i < kWindow; ++i) {
            const double* source = from + kRun * (i + kRead * outer);
            double* target = to + kRun * (i + kWindow * outer);
            for (int r = 0; r < kRun; ++r)
                target[r] = kTaps[0] * source[r] + kTaps[1] * source[r + kRun] +
                            kTaps[2] * source[r + 2 * kRun] + kTaps[3] * source[r + 3 * kRun] +
                            kTaps[4] * source[r + 4 * kRun] + kTaps[5] * source[r + 5 * kRun] +
                            kTaps[6] * source[r + 6 * kRun];
        }
}

} // namespace

void SmoothCursor::blur(const Samples& in, Blurred& out) {
    blur_axis<kWindow, kRead, 1, kRead * kRead>(in.data(), blurred_z_.data());
    blur_axis<kWindow, kRead, kWindow, kRead>(blurred_z_.data(), blurred_zy_.data());
    blur_axis<kWindow, kRead, kWindow * kWindow, 1>(blurred_zy_.data(), out.data());
}

} // namespace palpate
