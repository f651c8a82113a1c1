#include <algorithm>

#include "engine/segment/vector_flow.h"

#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include "engine/segment/multigrid.h"
#include "engine/segment/packed_floats.h"
#include "tests/unit/filter/twin.h"

namespace palpate {
namespace {

BrickArray<float> array_of(glm::uvec3 size, const std::function<double(glm::dvec3)>& value) {
    BrickArray<float> array(size);
    for (const glm::ivec3 i : twin::indices(glm::ivec3(size)))
        array.set(glm::uvec3(i), float(value(glm::dvec3(i))));
    return array;
}

// u = cos(pi x) cos(2 pi y) cos(pi z) on the unit cube has no flow through its sides, and
// u - mu laplace(u) = (1 + 6 pi^2 mu) u. Samples are the middles of cells of unequal sides h. Such
// waves m solve the discrete equation, too, with (2 sin(m pi h / 2) / h)^2 instead of (m pi)^2: of
// second order. The operator's least eigenvalue is 1 (the weight), so the distance from that
// solution is at most the residual.
void expect_solved(uint32_t n, double share, int most_cycles) {
    const glm::uvec3 size(n, n, n / 2);
    const glm::dvec3 h = 1.0 / glm::dvec3(size), waves(1, 2, 1);
    const double mu = 0.3;
    const auto u = [&](glm::dvec3 i) {
        const glm::dvec3 x = (i + 0.5) * h * M_PI * waves;
        return std::cos(x.x) * std::cos(x.y) * std::cos(x.z);
    };
    double operation = 1.0;
    for (int a = 0; a < 3; ++a)
        operation += mu * std::pow(2.0 * std::sin(waves[a] * M_PI * h[a] / 2.0) / h[a], 2);
    Multigrid grids(h, mu, array_of(size, [](glm::dvec3) { return 1; }));
    grids.start(array_of(size, [](glm::dvec3) { return 0; }),
                array_of(size, [&](glm::dvec3 i) { return operation * u(i); }));
    const double first = grids.residual();
    int cycles = 0;
    while (grids.residual() > share * first && cycles < 30) {
        grids.cycle();
        ++cycles;
    }
    EXPECT_LE(cycles, most_cycles) << n;
    const BrickArray<float> found = grids.take();
    double squares = 0;
    for (const glm::ivec3 i : twin::indices(glm::ivec3(size)))
        squares += std::pow(double{found.value(glm::uvec3(i))} - u(glm::dvec3(i)), 2);
    EXPECT_LE(std::sqrt(squares), share * first) << n;
}

// vector_flow.h promises a factor of 3 a cycle where sizes stay even, and of 1.4 where one is odd.
// Floats of u, off by 2^-25 each, are seen times 12 mu / h^2, which bounds what can be asked for:
// 1e-4 of the right side at 66.
TEST(Multigrid, SolvesTheDiscreteEquationInAsManyCyclesAsItSays) {
    expect_solved(16, 3e-5, 10);
    expect_solved(32, 3e-5, 10);
    expect_solved(66, 3e-4, 24); // bricks of two samples at the end
}

// The printed equation A v = b in double: A = |g|^2 - mu laplace with no flow through the border,
// b = |g|^2 g along an axis, and g by central differences of the rescaled edge map.
class Equation {
 public:
    Equation(const Volume& edges, int axis, double mu) : size_(edges.size()) {
        const glm::dvec3 h = spacing_mm(edges.grid());
        const double scale = 1.0 / (double{edges.range().max} - double{edges.range().min});
        for (int a = 0; a < 3; ++a)
            over_[a] = size_[a] > 1 ? mu / (h[a] * h[a]) : 0.0;
        for (const glm::ivec3 i : twin::indices(size_)) {
            glm::dvec3 g;
            for (int a = 0; a < 3; ++a)
                g[a] = scale * (twin::at(edges, i + step(a)) - twin::at(edges, i - step(a))) /
                       (2 * h[a]);
            guess.push_back(g[axis]);
            weight.push_back(glm::dot(g, g));
            right.push_back(glm::dot(g, g) * g[axis]);
        }
    }

    std::vector<double> weight, right, guess;

    size_t at(glm::ivec3 i) const {
        return size_t(i.x) + size_t(size_.x) * (size_t(i.y) + size_t(size_.y) * size_t(i.z));
    }
    // Calls visit(number of the neighbour, mu / h^2) for those of sample i within the volume.
    template <class Visit>
    void neighbours(glm::ivec3 i, const Visit& visit) const {
        for (int a = 0; a < 3; ++a)
            for (const glm::ivec3 n : {i - step(a), i + step(a)})
                if (n[a] >= 0 && n[a] < size_[a])
                    visit(at(n), over_[a]);
    }
    double off(const std::vector<double>& v) const { // |b - A v|
        double squares = 0;
        for (const glm::ivec3 i : twin::indices(size_)) {
            double r = right[at(i)] - weight[at(i)] * v[at(i)];
            neighbours(i, [&](size_t n, double k) { r += k * (v[n] - v[at(i)]); });
            squares += r * r;
        }
        return std::sqrt(squares);
    }
    // Norm over all samples of what floats add to b - A v: g from two samples and products of three
    // of it, sums of eight terms and their products, 36 roundings of 2^-24 of the largest partial
    // sum.
    double rounding(const std::vector<double>& v) const {
        double most = 0, squares = 0;
        for (const double one : v)
            most = std::max(most, std::abs(one));
        for (const glm::ivec3 i : twin::indices(size_)) {
            double sum = std::abs(right[at(i)]) + weight[at(i)] * most;
            neighbours(i, [&](size_t, double k) { sum += 2 * k * most; });
            squares += std::pow(36 * 0x1p-24 * sum, 2);
        }
        return std::sqrt(squares);
    }

    // A by its rows, dense, factored as L L' (Cholesky).
    std::vector<double> factor() const {
        const size_t n = right.size();
        std::vector<double> l(n * n, 0.0);
        for (const glm::ivec3 i : twin::indices(size_)) {
            l[at(i) * n + at(i)] += weight[at(i)];
            neighbours(i, [&](size_t k, double over) {
                l[at(i) * n + at(i)] += over;
                l[at(i) * n + k] -= over;
            });
        }
        for (size_t r = 0; r < n; ++r)
            for (size_t c = 0; c <= r; ++c) {
                double sum = l[r * n + c];
                for (size_t k = 0; k < c; ++k)
                    sum -= l[r * n + k] * l[c * n + k];
                l[r * n + c] = r == c ? std::sqrt(sum) : sum / l[c * n + c];
            }
        return l;
    }
    static std::vector<double> solve(const std::vector<double>& l, std::vector<double> b) {
        const size_t n = b.size();
        for (size_t r = 0; r < n; ++r) {
            for (size_t k = 0; k < r; ++k)
                b[r] -= l[r * n + k] * b[k];
            b[r] /= l[r * n + r];
        }
        for (size_t r = n; r-- > 0;) {
            for (size_t k = r + 1; k < n; ++k)
                b[r] -= l[k * n + r] * b[k];
            b[r] /= l[r * n + r];
        }
        return b;
    }

 private:
    static glm::ivec3 step(int axis) {
        glm::ivec3 d(0);
        d[axis] = 1;
        return d;
    }
    glm::ivec3 size_;
    glm::dvec3 over_{};
};

double norm(const std::vector<double>& v) {
    double squares = 0;
    for (const double one : v)
        squares += one * one;
    return std::sqrt(squares);
}

std::vector<double> values_of(const Volume& volume) {
    std::vector<double> values;
    for (const glm::ivec3 i : twin::indices(glm::ivec3(volume.size())))
        values.push_back(double{volume.value(glm::uvec3(i))});
    return values;
}

// A shell of 5 samples radius.
Volume shell(glm::uvec3 size) {
    return make_volume(make_grid(size, {0.8, 1.0, 2.5}), ScalarType::f32, [&](glm::uvec3 i) {
        const glm::dvec3 d = glm::dvec3(i) - 0.5 * glm::dvec3(size);
        return 100 * std::exp(-0.1 * std::pow(glm::length(d) - 5, 2));
    });
}

TEST(VectorFlow, SolvesThePrintedEquationToTheStatedResidual) {
    for (const glm::uvec3 size : {glm::uvec3(37, 20, 9), {40, 33, 1}, {5, 1, 34}}) {
        const Volume edges = shell(size);
        for (const int axis : {0, 2}) {
            VectorFlowReport report;
            const Volume v =
                vector_flow(edges, axis, {.mu = 0.2, .residual = 1e-4}, {}, &report).value();
            if (size[axis] == 1) {
                EXPECT_EQ(v.range(), (ValueRange{0, 0}));
                continue;
            }
            const Equation equation(edges, axis, 0.2);
            const std::vector<double> found = values_of(v);
            const double whole = norm(equation.right);
            EXPECT_LE(report.residual, 1e-4);
            EXPECT_NEAR(equation.off(found) / whole, report.residual,
                        equation.rounding(found) / whole);
            // A factor of 1.4 a cycle (vector_flow.h), from that of the first guess, which is g.
            const double first = equation.off(equation.guess) / whole;
            EXPECT_LE(report.cycles, std::ceil(std::log(first / 1e-4) / std::log(1.4)));
        }
    }
}

// The dense solution in double. A is symmetric and positive definite, so a residual r is an error
// of at most |r| over its least eigenvalue, which is found by inverse iteration.
TEST(VectorFlow, IsTheDenseSolution) {
    for (const glm::uvec3 size : {glm::uvec3(12, 9, 5), {7, 1, 33}, {23, 20, 1}}) {
        const Volume edges = shell(size);
        for (const int axis : {0, 1, 2}) {
            if (size[axis] == 1)
                continue;
            const Equation equation(edges, axis, 0.2);
            const std::vector<double> l = equation.factor();
            const std::vector<double> exact = Equation::solve(l, equation.right);
            EXPECT_LE(equation.off(exact), 1e-12 * norm(equation.right)); // of the twin itself
            std::vector<double> slow(exact.size(), 1.0);
            double least = 0;
            for (int round = 0; round < 50; ++round) {
                const double before = norm(slow);
                slow = Equation::solve(l, slow);
                least = before / norm(slow);
                for (double& one : slow)
                    one *= least;
            }
            VectorFlowReport report;
            const std::vector<double> found = values_of(
                vector_flow(edges, axis, {.mu = 0.2, .residual = 1e-4}, {}, &report).value());
            std::vector<double> difference = found;
            for (size_t i = 0; i < found.size(); ++i)
                difference[i] -= exact[i];
            const double bound =
                (report.residual * norm(equation.right) + equation.rounding(found)) / least;
            EXPECT_LE(norm(difference), bound);
            EXPECT_LE(bound, 0.1 * norm(exact)); // and so it says something
        }
    }
}

// The outline of a U, open to the top, in one slice: within its cavity the gradient of the edges is
// 0 midway between the walls, and the flow leads down to the bottom (Xu and Prince, figure 3).
TEST(VectorFlow, LeadsIntoACavity) {
    const Grid grid = make_grid({64, 64, 1}, {1, 1, 1});
    const Volume edges = make_volume(grid, ScalarType::f32, [](glm::uvec3 i) {
        const auto off = [&](double x0, double y0, double x1, double y1) { // of a straight line
            const glm::dvec2 a(x0, y0), b(x1, y1), p(i.x, i.y);
            const double t = std::clamp(glm::dot(p - a, b - a) / glm::dot(b - a, b - a), 0.0, 1.0);
            return glm::distance(p, a + t * (b - a));
        };
        const double d = std::min({off(24, 12, 24, 48), off(40, 12, 40, 48), off(24, 48, 40, 48)});
        return std::exp(-0.5 * d * d);
    });
    const Volume x = vector_flow(edges, 0, {}, {}).value(),
                 y = vector_flow(edges, 1, {}, {}).value();
    const Volume plain = derivative(edges, {0.0, 1, {}}, {}).value();
    for (uint32_t at = 30; at <= 42; ++at) {
        EXPECT_GT(y.value({32, at, 0}), 10 * std::abs(x.value({32, at, 0}))) << at;
        EXPECT_GT(y.value({32, at, 0}), 0.0f);
        EXPECT_GT(x.value({36, at, 0}), 0.0f); // beside the middle, to the nearer wall
        EXPECT_LT(x.value({28, at, 0}), 0.0f);
    }
    EXPECT_LT(std::abs(plain.value({32, 36, 0})), 1e-9f);
}

TEST(VectorFlow, FlipsWithItsInputAndThreadsChangeNoBit) {
    const glm::uvec3 size(40, 24, 12);
    const Volume edges = twin::noise(make_grid(size, {1, 1, 2}), ScalarType::i16);
    const Volume flipped = make_volume(edges.grid(), ScalarType::i16, [&](glm::uvec3 i) {
        return edges.value({size.x - 1 - i.x, i.y, i.z});
    });
    const VectorFlowOptions options{.mu = 0.2, .residual = 1e-6};
    const Volume v = vector_flow(edges, 0, options, {}).value();
    const Volume w = vector_flow(flipped, 0, options, {}).value();
    // Each is off by its residual, times the inverse of the operator: of noise the weights are of
    // the size of the right sides', so by some 1e-6 of the field.
    const float most = v.range().max;
    for (const glm::ivec3 i : twin::indices(glm::ivec3(size)))
        ASSERT_NEAR(w.value({size.x - 1 - uint32_t(i.x), i.y, i.z}), -v.value(glm::uvec3(i)),
                    1e-4f * most);
    for (const size_t threads : {1, 4}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        EXPECT_TRUE(twin::same_bits(vector_flow(edges, 0, options, {}).value(), v));
    }
}

// Weights W that are off by a share e of at most 1/4096 change v by the solution of (W - mu
// laplace) d = e W (g - v): by the maximum principle at most e times the largest |g - v|, with |v|
// at most the largest |g|. Packing v adds |v| / 256, and the two ends of the solver 1e-5 of the
// field each.
TEST(VectorFlow, PackedFloatsAreWithinTheirRounding) {
    const Volume edges = twin::noise(make_grid({40, 33, 12}, {1, 1, 2}), ScalarType::i16);
    const VectorFlowOptions options{.mu = 0.2, .residual = 1e-6};
    for (int axis = 0; axis < 3; ++axis) {
        const Volume g = derivative(edges, {0.0, axis, {}}, {}).value();
        const double most = double(std::max(-g.range().min, g.range().max)) /
                            (edges.range().max - edges.range().min);
        const Volume v = vector_flow(edges, axis, options, {}).value();
        VectorFlowOptions small = options;
        small.packed = true;
        const Volume packed = vector_flow(edges, axis, small, {}).value();
        ASSERT_EQ(packed.type(), ScalarType::u16);
        for (const glm::ivec3 i : twin::indices(glm::ivec3(edges.size()))) {
            const double exact = v.value(glm::uvec3(i));
            ASSERT_NEAR(unpacked_float(uint16_t(packed.value(glm::uvec3(i)))), exact,
                        2 * most / 4096 + std::abs(exact) / 256 + 1e-4 * most);
        }
    }
}

// Each component is off by as much as above, but for the packing of v, so their length by at most
// the root of the sum of the squares, and twice by the packing of the length so far; where the edge
// map has no data, it has none.
TEST(VectorFlow, ItsLengthIsThatOfTheComponents) {
    const Volume edges = twin::noise(make_grid({40, 33, 12}, {1, 1, 2}), ScalarType::f32, 9);
    ASSERT_GT(edges.no_data_count(), 0u);
    const VectorFlowOptions options{.mu = 0.2, .residual = 1e-6};
    const VectorField v = vector_flow(edges, options, {}).value();
    const Volume length = vector_flow_length(edges, options, {}).value();
    double squares = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const ValueRange g = derivative(edges, {0.0, axis, {}}, {}).value().range();
        const double most =
            double(std::max(-g.min, g.max)) / (edges.range().max - edges.range().min);
        squares += std::pow((2.0 / 4096 + 1e-4) * most, 2);
    }
    for (const glm::ivec3 i : twin::indices(glm::ivec3(edges.size()))) {
        const glm::uvec3 at(i);
        const glm::dvec3 exact(v[0].value(at), v[1].value(at), v[2].value(at));
        ASSERT_EQ(std::isnan(length.value(at)), std::isnan(edges.value(at)));
        if (!std::isnan(edges.value(at))) {
            const double off = std::sqrt(squares) + 2 * glm::length(exact) / 4096;
            ASSERT_NEAR(length.value(at), glm::length(exact), off);
        }
    }
}

TEST(PackedWeights, AreWithinTheirRounding) {
    for (const float largest : {1.0f, 0.37f, 3e-30f, 2e20f}) {
        const PackedWeights code(largest);
        for (float v = largest; v > 1e-12f * largest; v *= 0.9f) {
            const float kept = code.unpack(code.pack(v));
            ASSERT_LE(std::abs(double{kept} - v), std::max(0x1p-12 * v, 0x1p-31 * largest));
            ASSERT_EQ(code.pack(kept), code.pack(v));
        }
        EXPECT_EQ(code.unpack(code.pack(0.0f)), 0.0f);
    }
}

TEST(VectorFlow, FlatEdgesNoDataAndBadParameters) {
    const Grid grid = make_grid({12, 9, 5}, {1, 1, 2});
    const Volume flat = make_volume(grid, ScalarType::i16, [](glm::uvec3) { return 7.0; });
    EXPECT_EQ(vector_flow(flat, 0, {}, {}).value().range(), (ValueRange{0, 0}));
    const Volume holes = twin::noise(grid, ScalarType::f32, 9);
    const Volume v = vector_flow(holes, 1, {}, {}).value();
    EXPECT_EQ(v.no_data_count(), holes.no_data_count());
    const auto message = [&](const Volume& edges, VectorFlowOptions o) {
        const Result<Volume> made = vector_flow(edges, 0, o, {});
        return made ? std::string("made") : made.error().message;
    };
    EXPECT_EQ(message(flat, {.mu = 0}), "mu: expected a number above 0, found 0");
    EXPECT_EQ(message(flat, {.residual = 0}), "residual: expected 1e-06 .. 1, found 0");
    EXPECT_THAT(message(twin::noise(twin::turned({9, 9, 9}, {1, 1, 1}, true), ScalarType::i16), {}),
                ::testing::HasSubstr("the edge map"));
}

} // namespace
} // namespace palpate
