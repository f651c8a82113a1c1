#include "engine/segment/kernel.h"

#include <gmock/gmock.h>

#include <cmath>

namespace palpate {
namespace {

// Applies the kernel to f at 0, in double.
template <class F>
double apply(const Kernel& kernel, const F& f) {
    double sum = kernel.order == 0 ? f(0.0) : 0.0;
    for (int k = 1; k <= kernel.radius(); ++k)
        sum += double{kernel.weights[size_t(k)]} *
               (kernel.order == 1 ? f(k) - f(-k) : f(k) + f(-k) - 2.0 * f(0.0));
    return sum;
}

// The weights are floats: each is off by at most 2^-24 of itself, and so are sums of products of
// one sign. Factor 2 for the two roundings of a weight and its scale.
constexpr double kKernelRounding = 2.0 / (1 << 24);

TEST(Kernel, PolynomialsAreExactAtEverySigma) {
    for (const double sigma : {0.1, 0.3, 0.45, 0.6, 1.0, 1.57, 4.0, 13.0}) {
        const double v = sigma * sigma, x0 = 0.7;
        const Kernel smooth = gaussian_kernel(sigma, 0);
        // (x0 + x)^3 blurred by variance v: x0^3 + 3 x0 v.
        const auto cube = [&](double x) { return std::pow(x0 + x, 3); };
        EXPECT_NEAR(apply(smooth, cube), std::pow(x0, 3) + 3 * x0 * v, 4 * v * kKernelRounding)
            << sigma;
        // Its derivative: 3 x0^2 + 3 v; of x^4: 4 x0^3 + 12 x0 v.
        if (v >= 1.0 / 3.0) {
            const Kernel first = gaussian_kernel(sigma, 1);
            EXPECT_NEAR(apply(first, cube), 3 * x0 * x0 + 3 * v, (3 + 6 * v) * kKernelRounding)
                << sigma;
            EXPECT_NEAR(apply(first, [&](double x) { return std::pow(x0 + x, 4); }),
                        4 * std::pow(x0, 3) + 12 * x0 * v, (4 + 24 * v) * kKernelRounding)
                << sigma;
        }
        // The second of x^4: 12 (x0^2 + v). Its weights have both signs: their absolute moments
        // are below 4 times the signed ones.
        if (v >= 1.0 / 6.0) {
            EXPECT_NEAR(
                apply(gaussian_kernel(sigma, 2), [&](double x) { return std::pow(x0 + x, 4); }),
                12 * (x0 * x0 + v), 4 * 12 * (1 + v) * kKernelRounding)
                << sigma;
        }
    }
}

TEST(Kernel, SmallSigmasOfDerivativesAreDifferencesOfNeighbours) {
    for (const double sigma : {0.0, 0.1, 0.3}) {
        const Kernel first = gaussian_kernel(sigma, 1), second = gaussian_kernel(sigma, 2);
        EXPECT_EQ(first.weights[1], 0.5f) << sigma;
        EXPECT_EQ(second.weights[1], 1.0f) << sigma;
        for (size_t k = 2; k < first.weights.size(); ++k)
            EXPECT_LT(std::abs(first.weights[k]) + std::abs(second.weights[k]), 1e-20f);
    }
    EXPECT_EQ(gaussian_kernel(0.0, 0).weights[1], 0.0f);
}

double edge(double x, double deviation) {
    return 0.5 * std::erfc(-x / deviation * M_SQRT1_2);
}

// An edge of deviation e blurred by sigma is one of sqrt(e^2 + sigma^2).
// Cut off: 3.2e-5 on each side. The cut loses 2 * 4 phi(4) = 0.0011 of the variance, which s
// restores: 0.054 % wider, which moves the result by at most 0.00054 max(x phi(x)) = 1.3e-4.
// The sum in place of the integral: aliases at frequencies 1 and -1 of the product of kernel and
// edge, whose spectra meet at f = sigma^2 / (sigma^2 + e^2) of the edge's: each
// exp(-2 pi^2 e^2 f) / (2 pi f) / sqrt(2 pi (e^2 + sigma^2)) (saddle point).
double bound(double e, double sigma) {
    const double sum = e * e + sigma * sigma, f = sigma * sigma / sum;
    return 1.7e-4 + 2.0 * std::exp(-2.0 * M_PI * M_PI * e * e * f) / (2.0 * M_PI * f) /
                        std::sqrt(2.0 * M_PI * sum);
}

TEST(Kernel, EdgesErr) {
    for (const double e : {0.8, 1.3})
        for (const double sigma : {0.8, 1.0, 1.57, 2.3, 5.0, 11.0}) {
            const Kernel kernel = gaussian_kernel(sigma, 0);
            for (int n = -50; n <= 50; ++n)
                EXPECT_NEAR(apply(kernel, [&](double x) { return edge(n + x + 0.3, e); }),
                            edge(n + 0.3, std::hypot(e, sigma)), bound(e, sigma))
                    << e << " " << sigma << " " << n;
        }
}

// A step between samples 0 and 1 against the exact result for samples that stand for their cells:
// half the sum over a cell differs from the integral by g'/24, at most 0.242 / (24 sigma^2).
TEST(Kernel, SharpStepsErrAsStated) {
    for (const double sigma : {1.0, 2.3, 5.0}) {
        const Kernel kernel = gaussian_kernel(sigma, 0);
        double worst = 0;
        for (int n = -30; n <= 30; ++n) {
            const auto step = [&](double x) { return n + x > 0.5 ? 1.0 : 0.0; };
            worst = std::max(worst, std::abs(apply(kernel, step) - edge(n - 0.5, sigma)));
        }
        EXPECT_LT(worst, 0.0102 / (sigma * sigma) + 1.7e-4) << sigma;
        EXPECT_GT(worst, 0.005 / (sigma * sigma)) << sigma;
    }
}

} // namespace
} // namespace palpate
