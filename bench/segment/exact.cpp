#include "bench/segment/exact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/volume/box.h"

namespace palpate::bench {

namespace {

double sample_at(const Volume& volume, glm::ivec3 i) {
    return volume.value(glm::uvec3(glm::clamp(i, glm::ivec3(0), glm::ivec3(volume.size()) - 1)));
}

// The sampled Gaussian or its first derivative, by the index, cut at 8 sigma.
std::vector<double> weights(double sigma, bool derivative) {
    const int radius = int(std::ceil(8.0 * sigma));
    std::vector<double> w;
    double sum = 0;
    for (int n = -radius; n <= radius; ++n) {
        const double g = std::exp(-0.5 * n * n / (sigma * sigma));
        sum += g;
        w.push_back(derivative ? n / (sigma * sigma) * g : g);
    }
    for (double& one : w)
        one /= sum;
    return w;
}

double convolved(const Volume& volume, glm::ivec3 at, double sigma_mm, int derivative_axis) {
    std::array<std::vector<double>, 3> w;
    glm::ivec3 radius;
    for (int a = 0; a < 3; ++a) {
        w[size_t(a)] = weights(sigma_mm / spacing_mm(volume.grid())[a], a == derivative_axis);
        radius[a] = int(w[size_t(a)].size() / 2);
    }
    double sum = 0;
    for (int z = -radius.z; z <= radius.z; ++z)
        for (int y = -radius.y; y <= radius.y; ++y)
            for (int x = -radius.x; x <= radius.x; ++x)
                sum += w[0][size_t(x + radius.x)] * w[1][size_t(y + radius.y)] *
                       w[2][size_t(z + radius.z)] * sample_at(volume, at + glm::ivec3(x, y, z));
    return sum;
}

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Distance to the nearest sample for which other() holds, in shells of cubes about the sample.
template <class Other>
double distance_to(const Volume& volume, glm::ivec3 at, const Other& other) {
    const glm::dvec3 spacing = spacing_mm(volume.grid());
    const double least = std::min({spacing.x, spacing.y, spacing.z});
    const glm::ivec3 size(volume.size());
    double nearest = 1e300;
    for (int r = 1; r <= std::max({size.x, size.y, size.z}) && r * least < nearest; ++r)
        for (int z = std::max(-r, -at.z); z <= std::min(r, size.z - 1 - at.z); ++z)
            for (int y = std::max(-r, -at.y); y <= std::min(r, size.y - 1 - at.y); ++y) {
                const bool inner = std::abs(z) < r && std::abs(y) < r; // of a row both ends alone
                for (int x = -r; x <= r; x += inner ? 2 * r : 1) {
                    const glm::ivec3 q = at + glm::ivec3(x, y, z);
                    if (q.x >= 0 && q.x < size.x && other(volume.value(glm::uvec3(q))))
                        nearest = std::min(nearest, glm::length(spacing * glm::dvec3(x, y, z)));
                }
            }
    return nearest;
}

// The place of a sample of the turned grid in the input; false beyond its outermost centres.
bool place_of(const SegmentInput& in, glm::ivec3 at, glm::dvec3& place) {
    place = index_point(in.grey.grid(), world_point(turned_grid(in.grey.grid()), glm::dvec3(at)));
    return glm::all(glm::greaterThanEqual(place, glm::dvec3(0))) &&
           glm::all(glm::lessThanEqual(place, glm::dvec3(in.grey.size() - 1u)));
}

// Weights of the samples from floor(p) - kSplineReach on for the value at p of the interpolating
// cubic spline, whose coefficients are sums of samples with sqrt(3) (sqrt(3) - 2)^|k|.
constexpr int kSplineReach = 24; // 2e-14
std::array<double, 2 * kSplineReach + 1> spline_weights(double p) {
    std::array<double, 2 * kSplineReach + 1> weights{};
    const double low = std::floor(p);
    for (int i = 0; i < int(weights.size()); ++i)
        for (int j = -2; j <= 3; ++j) { // coefficient at low + j
            const double d = std::abs(p - low - j);
            const double b = d < 1   ? 2.0 / 3 - d * d + d * d * d / 2
                             : d < 2 ? std::pow(2 - d, 3) / 6
                                     : 0.0;
            weights[size_t(i)] +=
                b * std::sqrt(3.0) * std::pow(std::sqrt(3.0) - 2.0, std::abs(i - kSplineReach - j));
        }
    return weights;
}

} // namespace

double exact_gaussian(const SegmentInput& in, glm::ivec3 at) {
    return convolved(in.grey, at, 1.5, -1);
}
double exact_slope(const SegmentInput& in, glm::ivec3 at) {
    glm::dvec3 g;
    for (int a = 0; a < 3; ++a)
        g[a] = convolved(in.grey, at, 1.5, a);
    return glm::length(world_gradient(in.grey.grid(), g));
}

double exact_median(const SegmentInput& in, glm::ivec3 at) {
    std::vector<double> all;
    for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y)
            for (int x = -1; x <= 1; ++x)
                all.push_back(sample_at(in.grey, at + glm::ivec3(x, y, z)));
    std::nth_element(all.begin(), all.begin() + 13, all.end());
    return all[13];
}

// The bilateral filter of 2 mm and 50 HU, to 8 sigma in space.
double exact_bilateral(const SegmentInput& in, glm::ivec3 at) {
    const glm::dvec3 spacing = spacing_mm(in.grey.grid());
    const glm::ivec3 reach(16.0 / spacing);
    const double centre = sample_at(in.grey, at);
    double sum = 0, total = 0;
    for (int z = -reach.z; z <= reach.z; ++z)
        for (int y = -reach.y; y <= reach.y; ++y)
            for (int x = -reach.x; x <= reach.x; ++x) {
                const glm::dvec3 d = spacing * glm::dvec3(x, y, z) / 2.0;
                const double off = sample_at(in.grey, at + glm::ivec3(x, y, z)) - centre;
                const double w = std::exp(-0.5 * (glm::dot(d, d) + off * off / 2500.0));
                sum += w * off;
                total += w;
            }
    return centre + sum / total;
}

double exact_distance_outside(const SegmentInput& in, glm::ivec3 at) {
    if (in.bone.value(glm::uvec3(at)) != 0.0f)
        return kNone; // ITK measures to another sample there
    return distance_to(in.bone, at, [](float v) { return v != 0.0f; });
}
double exact_distance_of_labels(const SegmentInput& in, glm::ivec3 at) {
    const float own = in.tissues.value(glm::uvec3(at));
    const double away = distance_to(in.tissues, at, [&](float v) { return v != own; });
    return own != 0.0f ? -away : away;
}
double exact_distance_to_middle(const SegmentInput& in, glm::ivec3 at) {
    return glm::length(spacing_mm(in.grey.grid()) *
                       glm::dvec3(at - glm::ivec3(in.grey.size() / 2u)));
}

double exact_erosion(const SegmentInput& in, glm::ivec3 at) {
    double least = sample_at(in.bone, at);
    for (int a = 0; a < 3; ++a)
        for (const int side : {-1, 1}) {
            glm::ivec3 q = at;
            q[a] += side;
            least = std::min(least, sample_at(in.bone, q));
        }
    return least;
}
double exact_erosion_by_ball(const SegmentInput& in, glm::ivec3 at) {
    if (in.bone.value(glm::uvec3(at)) == 0.0f)
        return 0.0;
    return distance_to(in.bone, at, [](float v) { return v == 0.0f; }) > kBall_mm * (1 + 1e-9);
}

double exact_linear(const SegmentInput& in, glm::ivec3 at) {
    glm::dvec3 p;
    if (!place_of(in, at, p))
        return kNone;
    const glm::ivec3 low(glm::floor(p));
    double sum = 0;
    for (int c = 0; c < 8; ++c) {
        const glm::ivec3 d(c & 1, c >> 1 & 1, c >> 2);
        const glm::dvec3 w = 1.0 - glm::abs(p - glm::dvec3(low + d));
        sum += w.x * w.y * w.z * sample_at(in.grey, low + d);
    }
    return sum;
}

double exact_cubic(const SegmentInput& in, glm::ivec3 at) {
    glm::dvec3 p;
    if (!place_of(in, at, p))
        return kNone;
    const glm::ivec3 low(glm::floor(p)), last = glm::ivec3(in.grey.size()) - 1;
    // Near the border the spline depends on how the volume is continued, which is a choice.
    if (glm::any(glm::lessThan(low, glm::ivec3(12))) || glm::any(glm::greaterThan(low, last - 13)))
        return kNone;
    const auto wx = spline_weights(p.x), wy = spline_weights(p.y), wz = spline_weights(p.z);
    double sum = 0;
    for (int z = 0; z < int(wz.size()); ++z)
        for (int y = 0; y < int(wy.size()); ++y) {
            double row = 0;
            for (int x = 0; x < int(wx.size()); ++x)
                row += wx[size_t(x)] * sample_at(in.grey, low + glm::ivec3(x, y, z) - kSplineReach);
            sum += wz[size_t(z)] * wy[size_t(y)] * row;
        }
    return sum;
}

double flow_residual(const SegmentInput& in, const Samples& v) {
    const glm::ivec3 size(in.edges.size());
    Samples edges(v.size());
    read_box(in.edges, glm::ivec3(0), size, packed(in.edges.size()), edges.data());
    const auto at = [&](const Samples& of, glm::ivec3 i) {
        i = glm::clamp(i, glm::ivec3(0), size - 1);
        return double{
            of[size_t(i.x) + size_t(size.x) * (size_t(i.y) + size_t(size.y) * size_t(i.z))]};
    };
    double squares = 0, whole = 0;
    for (glm::ivec3 i(0); i.z < size.z; ++i.z)
        for (i.y = 0; i.y < size.y; ++i.y)
            for (i.x = 0; i.x < size.x; ++i.x) {
                glm::dvec3 g;
                double flow = 0;
                for (int a = 0; a < 3; ++a) {
                    glm::ivec3 d(0);
                    d[a] = 1;
                    g[a] = (at(edges, i + d) - at(edges, i - d)) / 2;
                    flow += at(v, i + d) - 2 * at(v, i) + at(v, i - d);
                }
                const double b = glm::dot(g, g);
                squares += std::pow(kFlowMu * flow - b * (at(v, i) - g.x), 2);
                whole += std::pow(b * g.x, 2);
            }
    return whole > 0 ? std::sqrt(squares / whole) : 0.0;
}

} // namespace palpate::bench
