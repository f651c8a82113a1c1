#pragma once

#include <array>
#include <glm/glm.hpp>

namespace palpate::reference {

constexpr int kNodes = 8;

// Gauss-Legendre on [-1, 1]: exact for polynomials up to degree 2 kNodes - 1.
// partial[i][j] is the weight of node j in the integral from -1 to node i of the polynomial of
// degree kNodes - 1 through all nodes.
struct Quadrature {
    std::array<double, kNodes> nodes, weights;
    std::array<std::array<double, kNodes>, kNodes> partial;
};
const Quadrature& gauss_legendre();

// Light through a piece of a ray: the optical depth, and the colour it gives towards its start.
struct Emission {
    double depth = 0.0;
    glm::dvec3 color{0.0};
};

// The piece from a to b of sample(t) -> (color, tau per mm), which is smooth there; halved (at most
// `halvings` times) until depth and colour change by less than `tolerance`.
template <class Sample>
Emission integrate(const Sample& sample, double a, double b, double tolerance, int halvings) {
    const auto rule = [&](double from, double to) {
        const Quadrature& q = gauss_legendre();
        const double half = 0.5 * (to - from);
        std::array<glm::dvec4, kNodes> at;
        for (int i = 0; i < kNodes; ++i)
            at[i] = sample(from + half * (1.0 + q.nodes[i]));
        Emission sum;
        for (int i = 0; i < kNodes; ++i) {
            double before = 0.0;
            for (int j = 0; j < kNodes; ++j)
                before += q.partial[i][j] * at[j].w;
            const double weight = half * q.weights[i] * at[i].w;
            sum.depth += weight;
            sum.color += weight * glm::exp(-half * before) * glm::dvec3(at[i]);
        }
        return sum;
    };
    const auto refine = [&](const auto& self, double from, double to, const Emission& whole,
                            int left) -> Emission {
        const double middle = 0.5 * (from + to);
        Emission front = rule(from, middle), back = rule(middle, to);
        const auto join = [&] {
            return Emission{front.depth + back.depth,
                            front.color + glm::exp(-front.depth) * back.color};
        };
        const Emission halves = join();
        const glm::dvec3 change = glm::abs(halves.color - whole.color);
        if (left == 0 || (glm::max(change.x, glm::max(change.y, change.z)) < tolerance &&
                          glm::abs(halves.depth - whole.depth) < tolerance * (1.0 + whole.depth)))
            return halves;
        front = self(self, from, middle, front, left - 1);
        back = self(self, middle, to, back, left - 1);
        return join();
    };
    return refine(refine, a, b, rule(a, b), halvings);
}

} // namespace palpate::reference
