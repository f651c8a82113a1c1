#include <algorithm>
#include <array>
#include <cmath>

#include "engine/segment/wire_curves.h"
#include "engine/volume/grid.h"

namespace palpate {

namespace {

// Values about a place by the index, smoothed by a Gaussian of a sample; NaN without data.
double smoothed_at(const Volume& volume, glm::dvec3 at) {
    constexpr int kReach = 3;
    const glm::ivec3 low = glm::ivec3(glm::floor(at)) - (kReach - 1);
    const glm::ivec3 last = glm::ivec3(volume.size()) - 1;
    std::array<std::array<double, 2 * kReach>, 3> weights;
    for (int axis = 0; axis < 3; ++axis)
        for (int i = 0; i < 2 * kReach; ++i) {
            const double off = double(low[axis] + i) - at[axis];
            weights[size_t(axis)][size_t(i)] = std::exp(-0.5 * off * off);
        }
    double sum = 0.0, total = 0.0;
    for (int z = 0; z < 2 * kReach; ++z)
        for (int y = 0; y < 2 * kReach; ++y)
            for (int x = 0; x < 2 * kReach; ++x) {
                const glm::ivec3 to = glm::clamp(low + glm::ivec3(x, y, z), glm::ivec3(0), last);
                const double v = volume.value(glm::uvec3(to));
                if (std::isnan(v))
                    continue;
                const double w =
                    weights[0][size_t(x)] * weights[1][size_t(y)] * weights[2][size_t(z)];
                sum += w * v;
                total += w;
            }
    return sum / total;
}

// The slope of the values by the index; 0 along `flat` axes.
glm::dvec3 slope_at(const Volume& volume, glm::dvec3 at, glm::bvec3 flat) {
    glm::dvec3 slope(0.0);
    for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 by(0.0);
        by[axis] = 0.5;
        if (!flat[axis])
            slope[axis] = smoothed_at(volume, at + by) - smoothed_at(volume, at - by);
    }
    return slope;
}

// The place near another, along the slope, where values change most: on the edge, and not on the
// sample before or behind it. By the index.
struct Edge {
    glm::dvec3 at;
    double rise = 0.0; // of the values there; 0 where they change most farther away
};
Edge edge_near(const Volume& volume, glm::dvec3 at, glm::bvec3 flat) {
    constexpr double kFarthest = 1.5, kSide = 0.25; // samples
    constexpr int kPlaces = int(kFarthest / kSide);
    const glm::dvec3 slope = slope_at(volume, at, flat);
    const double steepness = glm::length(slope);
    if (!(steepness > 0.0)) // nor NaN
        return {at};
    const glm::dvec3 way = slope / steepness;
    std::array<double, 2 * kPlaces + 3> values;
    for (int i = 0; i < int(values.size()); ++i)
        values[size_t(i)] = smoothed_at(volume, at + kSide * double(i - kPlaces - 1) * way);
    const auto rise = [&](int i) { return values[size_t(i) + 2] - values[size_t(i)]; };
    int best = 0;
    for (int i = 1; i <= 2 * kPlaces; ++i)
        if (rise(i) > rise(best))
            best = i;
    if (best == 0 || best == 2 * kPlaces)
        return {at};
    // The top of a parabola.
    const double before = rise(best - 1), after = rise(best + 1);
    const double bend = before - 2.0 * rise(best) + after;
    const double to = double(best - kPlaces) +
                      (bend < 0.0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0.0);
    return std::isfinite(to) ? Edge{at + kSide * to * way, rise(best)} : Edge{at};
}

// The smooth curve from one given point to the next: Hermite's cubic, whose slopes at both come
// from the points before and after, by their distances (Catmull & Rom 1974).
struct Stretch {
    glm::dvec3 from, to, slope_from, slope_to; // mm; slopes by the share of the stretch
    glm::dvec3 at(double s) const {
        const double u = 1.0 - s;
        return u * u * (1.0 + 2.0 * s) * from + s * s * (3.0 - 2.0 * s) * to +
               s * u * u * slope_from - s * s * u * slope_to;
    }
};
Stretch stretch_of(const std::vector<glm::dvec3>& points, size_t i) {
    const size_t n = points.size() - 1; // the last is the first
    const glm::dvec3 a = points[(i + n - 2) % n], b = points[i - 1], c = points[i];
    const glm::dvec3 d = points[(i + 1) % n];
    const double ab = glm::distance(a, b), bc = glm::distance(b, c), cd = glm::distance(c, d);
    Stretch out{b, c, c - b, c - b};
    if (bc > 0.0 && ab > 0.0)
        out.slope_from = bc * ((b - a) / ab - (c - a) / (ab + bc) + (c - b) / bc);
    if (bc > 0.0 && cd > 0.0)
        out.slope_to = bc * ((c - b) / bc - (d - b) / (bc + cd) + (d - c) / cd);
    return out;
}

// Reads a stretch from a wire of samples: as many places, evenly along it, each moved across the
// edge to where the wire is and then onto the edge, or onto one that is as clear beside the
// stretch. The wire knows no more than half a sample, as a sharp edge lies anywhere between two;
// from there to one and a half its say grows. Along the edge's surface it wanders from one cheap
// sample to another, which says nothing.
std::vector<glm::dvec3> between(const Volume& volume, const Stretch& stretch,
                                const std::vector<glm::dvec3>& wire, glm::bvec3 flat) {
    const Grid& grid = volume.grid();
    const glm::dmat3 axes(grid.world_from_index);
    const glm::dmat3 world = glm::transpose(glm::inverse(axes));
    const glm::dvec3 way = stretch.to - stretch.from;
    const double square = glm::dot(way, way);
    std::vector<glm::dvec3> places;
    for (size_t k = 0; k < wire.size(); ++k) {
        const double share = double(k + 1) / double(wire.size() + 1);
        const glm::dvec3 given = stretch.at(share);
        glm::dvec3 there = wire[k];
        double least = INFINITY;
        for (const glm::dvec3 at : wire) {
            const glm::dvec3 mm = world_point(grid, at);
            const double along = square > 0.0 ? glm::dot(mm - stretch.from, way) / square : share;
            const double off =
                std::abs(along - share) * std::sqrt(square) + 1e-3 * glm::distance(mm, given);
            if (off < least)
                least = off, there = at;
        }
        const glm::dvec3 slope = world * slope_at(volume, there, flat);
        if (const double length = glm::length(slope); length > 0.0) {
            const glm::dvec3 normal = slope / length;
            const auto off = [&](glm::dvec3 at) {
                return glm::dot(world_point(grid, at) - given, normal);
            };
            const Edge wired =
                edge_near(volume, index_point(grid, given + off(there) * normal), flat);
            const Edge near = edge_near(volume, index_point(grid, given), flat);
            // A wire may leave the edge; then the one beside the given way is as clear.
            const glm::dvec3 edge = near.rise > 0.5 * wired.rise ? near.at : wired.at;
            const double sample_mm = glm::length(glm::transpose(axes) * normal);
            const double say = std::clamp(std::abs(off(edge)) / sample_mm - 0.5, 0.0, 1.0);
            there = index_point(grid, given + say * off(edge) * normal);
        }
        places.push_back(there);
    }
    return places;
}

} // namespace

Result<WireCurve> along_edges(const Volume& volume, const WireCurve& curve,
                              const LiveWireOptions& options, const Task& task) {
    const Grid& grid = volume.grid();
    const glm::dvec3 last = glm::dvec3(grid.size) - 1.0;
    std::vector<glm::uvec3> places;
    for (const glm::dvec3 p : curve.points_mm)
        places.emplace_back(glm::clamp(glm::round(index_point(grid, p)), glm::dvec3(0.0), last));
    glm::bvec3 flat(true); // axes along which no point differs
    for (const glm::uvec3 p : places)
        flat = glm::bvec3(flat.x && p.x == places[0].x, flat.y && p.y == places[0].y,
                          flat.z && p.z == places[0].z);
    WireCurve out{curve.label, {curve.points_mm.front()}};
    for (size_t i = 1; i < places.size(); ++i) {
        const glm::uvec3 a = glm::min(places[i - 1], places[i]);
        const glm::uvec3 b = glm::max(places[i - 1], places[i]);
        const double apart = glm::length(glm::dvec3(b - a));
        const glm::uvec3 more(uint32_t(std::max(8.0, 0.5 * apart)));
        glm::uvec3 low = a - glm::min(a, more), high = glm::min(b + more, grid.size - 1u);
        low = glm::mix(low, a, flat), high = glm::mix(high, b, flat);
        PALPATE_TRY(LiveWireRegion region,
                    live_wire_region(volume, low, high - low + 1u, options, {task.stop, {}}));
        LiveWire wire(std::move(region));
        wire.set_anchor(places[i - 1] - low);
        const std::vector<glm::uvec3> path = wire.path(places[i] - low);
        std::vector<glm::dvec3> on;
        for (size_t k = 1; k + 1 < path.size(); ++k)
            on.push_back(glm::dvec3(low + path[k]));
        for (const glm::dvec3 at : between(volume, stretch_of(curve.points_mm, i), on, flat))
            out.points_mm.push_back(world_point(grid, at));
        out.points_mm.push_back(curve.points_mm[i]);
        if (task.progress)
            task.progress(double(i) / double(places.size()));
    }
    return out;
}

} // namespace palpate
