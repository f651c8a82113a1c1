#include "engine/segment/gaussian.h"

#include <cmath>

#include "engine/base/clones.h"
#include "engine/segment/derivatives.h"

namespace palpate {

namespace {

using Arrays = std::vector<std::vector<float>>;

// A filter that makes a sample of the smoothed volume or its derivatives there: combine(arrays)
// leaves the result in arrays[0]; `of_constant` is that of a constant volume.
template <class Combine>
Result<BrickMaker> derived(const Volume& volume, double sigma_mm, std::vector<glm::ivec3> orders,
                           const Combine& combine, bool keeps_constants) {
    PALPATE_TRY(Derivatives::check(volume, sigma_mm));
    return BrickMaker{volume.grid(), ScalarType::f32,
                      [derivatives = Derivatives(volume, sigma_mm), orders = std::move(orders),
                       combine, keeps_constants](glm::uvec3 at) {
                          thread_local Arrays arrays;
                          if (!derivatives.compute(at, orders, arrays)) {
                              const float value = derivatives.volume().brick(at).value(0);
                              return constant_brick(
                                  ScalarType::f32,
                                  keeps_constants || std::isnan(value) ? value : 0.0f);
                          }
                          combine(arrays);
                          return BrickPtr(Brick::make(std::span<const float>(arrays[0]),
                                                      derivatives.volume().valid_in_brick(at)));
                      }};
}

// Rows of the matrix that takes gradients by the index to gradients by world mm.
glm::dmat3 world_from_index_gradient(const Grid& grid) {
    return glm::transpose(glm::inverse(glm::dmat3(grid.world_from_index)));
}

const std::vector<glm::ivec3> kFirst{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const std::vector<glm::ivec3> kSecond{{2, 0, 0}, {0, 2, 0}, {0, 0, 2},
                                      {1, 1, 0}, {1, 0, 1}, {0, 1, 1}};

// arrays[0] = sum of factors[i] * arrays[i].
PALPATE_CLONES void weighted_sum(Arrays& arrays, const std::vector<float>& factors) {
    float* to = arrays[0].data();
    for (size_t i = 0; i < kBrickSamples; ++i)
        to[i] *= factors[0];
    for (size_t a = 1; a < arrays.size(); ++a) {
        const float* from = arrays[a].data();
        for (size_t i = 0; i < kBrickSamples; ++i)
            to[i] += factors[a] * from[i];
    }
}

// arrays[0] = length of matrix * (arrays[0], arrays[1], arrays[2]).
PALPATE_CLONES void lengths(Arrays& arrays, const float* m) {
    float* x = arrays[0].data();
    const float* y = arrays[1].data();
    const float* z = arrays[2].data();
    for (size_t i = 0; i < kBrickSamples; ++i) {
        const float a = m[0] * x[i] + m[3] * y[i] + m[6] * z[i];
        const float b = m[1] * x[i] + m[4] * y[i] + m[7] * z[i];
        const float c = m[2] * x[i] + m[5] * y[i] + m[8] * z[i];
        // The square of a float's value is within a double.
        const double square = double{a} * double{a} + double{b} * double{b} + double{c} * double{c};
        x[i] = float(std::sqrt(square));
    }
}

} // namespace

Result<BrickMaker> gaussian_bricks(const Volume& volume, const GaussianOptions& options) {
    return derived(
        volume, options.sigma_mm, {glm::ivec3(0)}, [](Arrays&) {}, true);
}

Result<BrickMaker> derivative_bricks(const Volume& volume, const DerivativeOptions& options) {
    const auto in_range = [](int axis) { return axis >= 0 && axis < 3; };
    if (!in_range(options.axis) || !in_range(options.second_axis.value_or(0)))
        return fail("derivative: expected axes 0 .. 2, found {} and {}", options.axis,
                    options.second_axis.value_or(0));
    const glm::dmat3 m = world_from_index_gradient(volume.grid());
    std::vector<glm::ivec3> orders;
    std::vector<float> factors;
    const auto add = [&](glm::ivec3 order, double factor) {
        if (factor == 0.0)
            return;
        orders.push_back(order);
        factors.push_back(float(factor));
    };
    const auto made = [&] {
        return derived(
            volume, options.sigma_mm, orders,
            [factors](Arrays& arrays) { weighted_sum(arrays, factors); }, false);
    };
    if (!options.second_axis) {
        for (int i = 0; i < 3; ++i)
            add(kFirst[size_t(i)], m[i][options.axis]);
        return made();
    }
    const auto row = [&](int axis) { return glm::dvec3(m[0][axis], m[1][axis], m[2][axis]); };
    const glm::dvec3 a = row(options.axis), b = row(*options.second_axis);
    for (const glm::ivec3 order : kSecond) {
        double factor = 0;
        for (int p = 0; p < 3; ++p)
            for (int q = 0; q < 3; ++q) {
                glm::ivec3 both(0);
                ++both[p];
                ++both[q];
                factor += both == order ? a[p] * b[q] : 0.0;
            }
        add(order, factor);
    }
    return made();
}

Result<BrickMaker> gradient_magnitude_bricks(const Volume& volume, const GaussianOptions& options) {
    const glm::mat3 m(world_from_index_gradient(volume.grid()));
    return derived(
        volume, options.sigma_mm, kFirst, [m](Arrays& arrays) { lengths(arrays, &m[0][0]); },
        false);
}

Result<Volume> gaussian(const Volume& volume, const GaussianOptions& options, const Task& task) {
    PALPATE_TRY(const BrickMaker maker, gaussian_bricks(volume, options));
    return make_bricks(maker, task);
}

Result<Volume> derivative(const Volume& volume, const DerivativeOptions& options,
                          const Task& task) {
    PALPATE_TRY(const BrickMaker maker, derivative_bricks(volume, options));
    return make_bricks(maker, task);
}

Result<Volume> gradient_magnitude(const Volume& volume, const GaussianOptions& options,
                                  const Task& task) {
    PALPATE_TRY(const BrickMaker maker, gradient_magnitude_bricks(volume, options));
    return make_bricks(maker, task);
}

Result<VectorField> gradient(const Volume& volume, const GaussianOptions& options,
                             const Task& task) {
    std::vector<Volume> parts;
    for (int axis = 0; axis < 3; ++axis) {
        PALPATE_TRY(Volume part, derivative(volume, {options.sigma_mm, axis, {}},
                                            task.part(axis / 3.0, (axis + 1) / 3.0)));
        parts.push_back(std::move(part));
    }
    return VectorField{parts[0], parts[1], parts[2]};
}

} // namespace palpate
