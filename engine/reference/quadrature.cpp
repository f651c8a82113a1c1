#include "engine/reference/quadrature.h"

#include <cmath>

namespace palpate::reference {

namespace {

// Legendre polynomial of degree kNodes and its derivative, by the three-term recurrence.
std::pair<double, double> legendre(double x) {
    double before = 1.0, p = x;
    for (int n = 2; n <= kNodes; ++n) {
        const double next = ((2.0 * n - 1.0) * x * p - (n - 1.0) * before) / n;
        before = p;
        p = next;
    }
    return {p, kNodes * (x * p - before) / (x * x - 1.0)};
}

Quadrature make_quadrature() {
    Quadrature q;
    for (int i = 0; i < kNodes; ++i) {
        double x = -std::cos(std::acos(-1.0) * (i + 0.75) / (kNodes + 0.5));
        for (int newton = 0; newton < 20; ++newton) {
            const auto [p, slope] = legendre(x);
            x -= p / slope;
        }
        const double slope = legendre(x).second;
        q.nodes[i] = x;
        q.weights[i] = 2.0 / ((1.0 - x * x) * slope * slope);
    }
    // Integrals of the Lagrange polynomials, by the rule itself, which is exact for them.
    for (int i = 0; i < kNodes; ++i)
        for (int j = 0; j < kNodes; ++j) {
            const double half = 0.5 * (q.nodes[i] + 1.0);
            double sum = 0.0;
            for (int g = 0; g < kNodes; ++g) {
                const double x = half * (q.nodes[g] + 1.0) - 1.0;
                double lagrange = 1.0;
                for (int k = 0; k < kNodes; ++k)
                    if (k != j)
                        lagrange *= (x - q.nodes[k]) / (q.nodes[j] - q.nodes[k]);
                sum += half * q.weights[g] * lagrange;
            }
            q.partial[i][j] = sum;
        }
    return q;
}

} // namespace

const Quadrature& gauss_legendre() {
    static const Quadrature quadrature = make_quadrature();
    return quadrature;
}

} // namespace palpate::reference
