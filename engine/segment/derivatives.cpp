#include "engine/segment/derivatives.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "engine/segment/gaussian.h"
#include "engine/segment/separable.h"
#include "engine/volume/extent.h"

namespace palpate {

namespace {

int place_of(glm::ivec3 order) {
    return order.x + 3 * order.y + 9 * order.z;
}

// Derivatives of one box of samples, each made once and when it is asked for. The axes along which
// a derivative is taken come first: a smoothed sample of large values would be rounded before the
// difference.
class BoxDerivatives {
 public:
    void begin(glm::ivec3 size, const float* samples,
               const std::array<std::array<Kernel, 3>, 3>& kernels) {
        size_ = size;
        samples_ = samples;
        kernels_ = &kernels;
        for (auto& [passes, step] : made_)
            step.is_made = false;
    }

    const std::vector<float>& of(glm::ivec3 order) {
        glm::ivec3 size = size_;
        const float* from = samples_;
        const Box* last = nullptr;
        int passes = 0; // a digit for each: its axis and order
        for (const bool smooths : {false, true})
            for (int axis = 0; axis < 3; ++axis) {
                if ((order[axis] == 0) != smooths)
                    continue;
                passes = 10 * passes + 3 * axis + order[axis] + 1;
                Step& step = made_[passes];
                if (!step.is_made)
                    convolve(size, from, axis, (*kernels_)[size_t(axis)][size_t(order[axis])],
                             step.box);
                step.is_made = true;
                last = &step.box;
                size = last->size;
                from = last->samples.data();
            }
        return last->samples;
    }

 private:
    struct Step {
        Box box;
        bool is_made = false;
    };
    glm::ivec3 size_{};
    const float* samples_ = nullptr;
    const std::array<std::array<Kernel, 3>, 3>* kernels_ = nullptr;
    std::map<int, Step> made_;
};

struct Scratch {
    Neighbourhood near;
    std::vector<float> has_data; // 1 or 0
    BoxDerivatives values, weights;
};

// With f = N / D, of which N and D are the smoothed values and weights, the derivatives of
// N = f D give those of f (Leibniz): f_a = (N_a - sum over b < a of C(a, b) f_b D_(a-b)) / D.
// Where all samples have data, D is 1 and its derivatives are 0, to the bit.
void quotient(Scratch& scratch, glm::ivec3 order, size_t count,
              std::array<std::vector<float>, 27>& made) {
    std::vector<float>& out = made[size_t(place_of(order))];
    if (!out.empty())
        return;
    const std::vector<float> top = scratch.values.of(order);
    out.assign(top.begin(), top.begin() + std::ptrdiff_t(count));
    for (int z = 0; z <= order.z; ++z)
        for (int y = 0; y <= order.y; ++y)
            for (int x = 0; x <= order.x; ++x) {
                const glm::ivec3 below(x, y, z);
                if (below == order)
                    continue;
                quotient(scratch, below, count, made);
                const std::vector<float>& f = made[size_t(place_of(below))];
                const std::vector<float>& d = scratch.weights.of(order - below);
                float times = 1.0f;
                for (int a = 0; a < 3; ++a)
                    times *= order[a] == 2 && below[a] == 1 ? 2.0f : 1.0f;
                for (size_t i = 0; i < count; ++i)
                    out[i] -= times * f[i] * d[i];
            }
    const std::vector<float>& d = scratch.weights.of(glm::ivec3(0));
    for (size_t i = 0; i < count; ++i)
        out[i] /= d[i];
}

} // namespace

Result<void> Derivatives::check(const Volume& volume, double sigma_mm) {
    PALPATE_TRY(check_magnitude(volume));
    const double most = kLargestSigma * smallest_spacing_mm(volume.grid());
    if (!(sigma_mm >= 0.0 && sigma_mm <= most))
        return fail(
            "sigma: expected 0 .. {:g} mm, which is {:g} samples of the finest axis, found {:g}",
            most, kLargestSigma, sigma_mm);
    return {};
}

Derivatives::Derivatives(Volume volume, double sigma_mm) : volume_(std::move(volume)) {
    const glm::dvec3 spacing = spacing_mm(volume_.grid());
    for (int axis = 0; axis < 3; ++axis)
        for (int order = 0; order < 3; ++order) {
            Kernel& kernel = kernels_[size_t(axis)][size_t(order)];
            kernel = gaussian_kernel(sigma_mm / spacing[axis], order);
            halo_[axis] = kernel.radius();
        }
}

bool Derivatives::compute(glm::uvec3 brick, std::span<const glm::ivec3> orders,
                          std::vector<std::vector<float>>& out) const {
    thread_local Scratch scratch;
    read_neighbourhood(volume_, brick, halo_, scratch.near);
    if (scratch.near.constant)
        return false;
    out.resize(orders.size());
    std::vector<float>& samples = scratch.near.samples;
    if (!scratch.near.lacks_data) {
        scratch.values.begin(scratch.near.size, samples.data(), kernels_);
        for (size_t i = 0; i < orders.size(); ++i) {
            const std::vector<float>& made = scratch.values.of(orders[i]);
            out[i].resize(kBrickSamples);
            std::copy(made.begin(), made.end(), out[i].begin());
        }
        return true;
    }
    // 0 takes the place of no data: of values about the middle of all.
    const float middle = 0.5f * (volume_.range().min + volume_.range().max);
    scratch.has_data.resize(samples.size());
    for (size_t i = 0; i < samples.size(); ++i) {
        const bool has = !std::isnan(samples[i]);
        scratch.has_data[i] = has ? 1.0f : 0.0f;
        samples[i] = has ? samples[i] - middle : 0.0f;
    }
    scratch.values.begin(scratch.near.size, samples.data(), kernels_);
    scratch.weights.begin(scratch.near.size, scratch.has_data.data(), kernels_);
    const glm::ivec3 size = scratch.near.size;
    const uint32_t planes = uint32_t(size.z - 2 * halo_.z);
    const size_t count = size_t{kBrickSide} * kBrickSide * planes;
    std::array<std::vector<float>, 27> made;
    for (size_t i = 0; i < orders.size(); ++i) {
        quotient(scratch, orders[i], count, made);
        const std::vector<float>& from = made[size_t(place_of(orders[i]))];
        const float add = orders[i] == glm::ivec3(0) ? middle : 0.0f;
        out[i].resize(kBrickSamples);
        for (uint32_t z = 0; z < planes; ++z)
            for (uint32_t y = 0; y < kBrickSide; ++y)
                for (uint32_t x = 0; x < kBrickSide; ++x) {
                    const size_t at = size_t(halo_.x) + x +
                                      size_t(size.x) * (size_t(halo_.y) + y +
                                                        size_t(size.y) * (size_t(halo_.z) + z));
                    const uint32_t to = offset_in_brick({x, y, z});
                    out[i][to] = scratch.has_data[at] == 0.0f
                                     ? std::numeric_limits<float>::quiet_NaN()
                                     : from[to] + add;
                }
    }
    return true;
}

} // namespace palpate
