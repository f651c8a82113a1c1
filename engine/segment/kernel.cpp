#include "engine/segment/kernel.h"

#include <cmath>

namespace palpate {

namespace {

// Unscaled weights of distances 0 .. radius.
std::vector<double> shape(double s, int order, int radius) {
    std::vector<double> w(size_t(radius) + 1);
    double sum = 0, second = 0;
    for (int n = 0; n <= radius; ++n) {
        w[size_t(n)] = std::exp(-0.5 * (n / s) * (n / s));
        const double both = n == 0 ? 1.0 : 2.0;
        sum += both * w[size_t(n)];
        second += both * w[size_t(n)] * n * n;
    }
    for (int n = 0; n <= radius; ++n)
        w[size_t(n)] *= order == 0 ? 1.0 : order == 1 ? double(n) : n * n - second / sum;
    return w;
}

double moment(const std::vector<double>& w, int power) {
    double sum = power == 0 ? w[0] : 0.0;
    for (size_t n = 1; n < w.size(); ++n)
        sum += 2.0 * w[n] * std::pow(double(n), power);
    return sum;
}

} // namespace

Kernel gaussian_kernel(double sigma, int order) {
    const int radius = std::max(1, int(std::ceil(kReach * sigma)));
    // Ratio of the two moments for the true kernel: variance; 3 and 6 times it.
    const double wanted = (order == 0 ? 1.0 : order == 1 ? 3.0 : 6.0) * sigma * sigma;
    const auto ratio = [&](double s) {
        const std::vector<double> w = shape(s, order, radius);
        return moment(w, order + 2) / moment(w, order);
    };
    // The ratio ascends with s; below `low` the nearest samples outweigh all others by 1e21.
    double low = 0.1, high = 2.0 * sigma + 1.0;
    if (order == 0 && sigma <= 0.0)
        return {order, {0.0f, 0.0f}};
    if (order == 0)
        low = 1e-3;
    for (int i = 0; i < 100; ++i) {
        const double middle = 0.5 * (low + high);
        (ratio(middle) < wanted ? low : high) = middle;
    }
    const std::vector<double> w = shape(high, order, radius);
    const double scale = order == 2 ? 2.0 / moment(w, 2) : 1.0 / moment(w, order);
    Kernel kernel{order, std::vector<float>(w.size())};
    for (size_t n = 1; n < w.size(); ++n)
        kernel.weights[n] = float(w[n] * scale);
    return kernel;
}

} // namespace palpate
