#include "engine/segment/wire_curves.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include "engine/volume/extent.h"

namespace palpate {

namespace {

constexpr double kStep = 0.5;         // of the smallest spacing, between points of an evened curve
constexpr double kEven_samples = 2.0; // to each side, over which it is evened
constexpr double kCross = 0.2;        // sine of the least angle of a crossing, 12 degrees

double diagonal_mm(const Grid& grid) {
    return glm::length(spacing_mm(grid));
}

std::string text_of(glm::dvec3 mm) {
    return fmt::format("({:.4g}, {:.4g}, {:.4g}) mm", mm.x, mm.y, mm.z);
}

// A closed curve of points in even steps.
struct Curve {
    size_t number;                     // in the input, from 1
    std::vector<glm::dvec3> at, along; // unit directions
    glm::dvec3 up{0.0};                // of the plane it lies in, nearly; it runs left about it
    // Across the curve at a point: outward in its plane, and up.
    std::pair<glm::dvec3, glm::dvec3> frame(size_t i) const {
        glm::dvec3 out = glm::cross(along[i], up);
        if (glm::length(out) < 1e-6)
            out = glm::cross(
                along[i], glm::abs(along[i].x) < 0.7 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0));
        out = glm::normalize(out);
        return {out, glm::cross(out, along[i])};
    }
};

Result<void> check_curve(const Grid& grid, const WireCurve& curve, size_t number) {
    const std::vector<glm::dvec3>& points = curve.points_mm;
    for (const glm::dvec3 p : points) {
        const glm::dvec3 index = index_point(grid, p);
        if (!(glm::all(glm::greaterThanEqual(index, glm::dvec3(-0.5 - 1e-9))) &&
              glm::all(glm::lessThanEqual(index, glm::dvec3(grid.size) - (0.5 - 1e-9)))))
            return fail("curve {} leaves the volume at {}; the volume holds {}", number, text_of(p),
                        text_of(world_box(grid, 0.5)));
    }
    if (points.size() < 4)
        return fail("curve {}: expected three points or more and the first again, found {} points",
                    number, points.size());
    if (const double gap = glm::distance(points.front(), points.back()); gap > diagonal_mm(grid))
        return fail("curve {} does not close: its ends are {:.3g} mm apart", number, gap);
    return {};
}

Result<Curve> evened(const Grid& grid, const WireCurve& curve, size_t number) {
    PALPATE_TRY(check_curve(grid, curve, number));
    std::vector<glm::dvec3> points = curve.points_mm;
    points.back() = points.front();
    std::vector<double> length(points.size(), 0.0);
    glm::dvec3 area(0.0);
    for (size_t i = 1; i < points.size(); ++i) {
        length[i] = length[i - 1] + glm::distance(points[i], points[i - 1]);
        area += 0.5 * glm::cross(points[i - 1] - points[0], points[i] - points[0]);
    }
    const double sample_mm = smallest_spacing_mm(grid), whole = length.back();
    // A square of a sample is no less around something.
    if (!(glm::length(area) > sample_mm * sample_mm))
        return fail("curve {} runs around nothing", number);
    Curve out{number, {}, {}, glm::normalize(area)};
    const auto count = std::max(size_t(whole / (kStep * sample_mm)), size_t{16});
    std::vector<glm::dvec3> even;
    for (size_t i = 0, at = 1; i < count; ++i) {
        const double to = whole * double(i) / double(count);
        while (at + 1 < points.size() && length[at] < to)
            ++at;
        const double step = length[at] - length[at - 1];
        even.push_back(
            glm::mix(points[at - 1], points[at], step > 0.0 ? (to - length[at - 1]) / step : 0.0));
    }
    const size_t side = std::min(size_t(kEven_samples / kStep), count / 8);
    // Places on the parabola through the points to each side (Savitzky & Golay 1964), as a mean
    // would draw a circle inward; directions from their means, which are steadier.
    const auto m = double(side);
    std::vector<glm::dvec3> means;
    for (size_t i = 0; i < count; ++i) {
        glm::dvec3 sum(0.0), mean(0.0);
        for (size_t k = 0; k <= 2 * side; ++k) {
            const double off = double(k) - m;
            const glm::dvec3 p = even[(i + count + k - side) % count];
            sum += 3.0 * (3.0 * m * m + 3.0 * m - 1.0 - 5.0 * off * off) * p;
            mean += p / (2.0 * m + 1.0);
        }
        out.at.push_back(sum / ((2.0 * m - 1.0) * (2.0 * m + 1.0) * (2.0 * m + 3.0)));
        means.push_back(mean);
    }
    for (size_t i = 0; i < count; ++i) {
        const glm::dvec3 by = means[(i + side + 1) % count] - means[(i + count - side - 1) % count];
        out.along.push_back(glm::length(by) > 0.0 ? glm::normalize(by) : out.up);
    }
    return out;
}

// The place where two curves cross.
struct CurveCrossing {
    std::array<size_t, 2> curve, place; // of each, the curve in the list and the point on it
    glm::dvec3 normal;                  // of either sign
};

struct Nearest {
    std::vector<double> away;
    std::vector<size_t> place;
};
Nearest nearest(const Curve& of, const Curve& to) {
    Nearest out;
    for (const glm::dvec3 p : of.at) {
        double best = INFINITY;
        size_t place = 0;
        for (size_t k = 0; k < to.at.size(); ++k) {
            const glm::dvec3 off = to.at[k] - p;
            if (const double squared = glm::dot(off, off); squared < best) {
                best = squared;
                place = k;
            }
        }
        out.away.push_back(std::sqrt(best));
        out.place.push_back(place);
    }
    return out;
}

// Once for every stretch of one curve that is near the other.
void find_crossings(const std::vector<Curve>& curves, size_t a, size_t b, double near_mm,
                    std::vector<CurveCrossing>& out, double& least_mm) {
    const Nearest found = nearest(curves[a], curves[b]);
    const size_t count = found.away.size();
    least_mm = *std::min_element(found.away.begin(), found.away.end());
    const auto far = std::find_if(found.away.begin(), found.away.end(),
                                  [&](double away) { return away > near_mm; });
    if (far == found.away.end())
        return; // one lies on the other
    const auto first = size_t(far - found.away.begin());
    for (size_t n = 0; n < count;) {
        size_t best = (first + n) % count;
        if (found.away[best] > near_mm) {
            ++n;
            continue;
        }
        for (; n < count && found.away[(first + n) % count] <= near_mm; ++n)
            if (found.away[(first + n) % count] < found.away[best])
                best = (first + n) % count;
        const glm::dvec3 across =
            glm::cross(curves[a].along[best], curves[b].along[found.place[best]]);
        if (glm::length(across) >= kCross)
            out.push_back({{a, b}, {best, found.place[best]}, glm::normalize(across)});
    }
}

size_t root_of(std::vector<size_t>& parents, size_t i) {
    while (parents[i] != i)
        i = parents[i] = parents[parents[i]];
    return i;
}

// A crossing as a curve passes it: its place on the curve, and the angle of its normal there.
struct Pass {
    size_t place, crossing;
    double angle;
};
std::vector<std::vector<Pass>> passes_of(const std::vector<Curve>& curves,
                                         const std::vector<CurveCrossing>& crossings) {
    std::vector<std::vector<Pass>> out(curves.size());
    for (size_t c = 0; c < crossings.size(); ++c)
        for (size_t side = 0; side < 2; ++side) {
            const size_t curve = crossings[c].curve[side], place = crossings[c].place[side];
            const auto [outward, up] = curves[curve].frame(place);
            const glm::dvec3 n = crossings[c].normal;
            out[curve].push_back({place, c, std::atan2(glm::dot(n, up), glm::dot(n, outward))});
        }
    for (std::vector<Pass>& passes : out)
        std::sort(passes.begin(), passes.end(), [](const Pass& a, const Pass& b) {
            return std::tie(a.place, a.crossing) < std::tie(b.place, b.crossing);
        });
    return out;
}

// Turns normals over so that along curves they turn as little as they can: the pairs that say most
// clearly which sign fits come first.
void choose_signs(const std::vector<std::vector<Pass>>& passes, std::vector<bool>& turned) {
    struct Pair {
        size_t a, b;
        double agreement; // cosine of the angle between the normals
    };
    std::vector<Pair> pairs;
    for (const std::vector<Pass>& along : passes)
        for (size_t i = 0; i < along.size() && along.size() > 1; ++i) {
            const Pass &p = along[i], &q = along[(i + 1) % along.size()];
            pairs.push_back({p.crossing, q.crossing, std::cos(p.angle - q.angle)});
        }
    std::stable_sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
        return std::abs(a.agreement) > std::abs(b.agreement);
    });
    std::vector<size_t> group(turned.size());
    std::iota(group.begin(), group.end(), size_t{0});
    for (const Pair& pair : pairs) {
        if (group[pair.a] == group[pair.b])
            continue;
        const bool differ = (turned[pair.a] != turned[pair.b]) != (pair.agreement < 0.0);
        const size_t joined = group[pair.b], into = group[pair.a];
        for (size_t i = 0; i < group.size(); ++i)
            if (group[i] == joined) {
                group[i] = into;
                turned[i] = turned[i] != differ;
            }
    }
}

// Normals along a curve that some others cross.
std::vector<SurfacePoint> with_normals(const Curve& curve, const std::vector<Pass>& passes,
                                       const std::vector<bool>& turned) {
    constexpr double kPi = 3.14159265358979323846;
    const size_t count = curve.at.size();
    std::vector<SurfacePoint> out(count);
    for (size_t n = 0; n < passes.size(); ++n) {
        const Pass &from = passes[n], &to = passes[(n + 1) % passes.size()];
        const double begin = from.angle + (turned[from.crossing] ? kPi : 0.0);
        const double end = to.angle + (turned[to.crossing] ? kPi : 0.0);
        const double turn = std::remainder(end - begin, 2.0 * kPi);
        const size_t steps = passes.size() == 1 || to.place <= from.place
                                 ? to.place + count - from.place
                                 : to.place - from.place;
        for (size_t k = 0; k < steps && n + 1 <= passes.size(); ++k) {
            const size_t i = (from.place + k) % count;
            const double angle = begin + turn * double(k) / double(steps);
            const auto [outward, up] = curve.frame(i);
            out[i] = {curve.at[i], std::cos(angle) * outward + std::sin(angle) * up};
        }
    }
    return out;
}

WireBody body_of(uint16_t label, const std::vector<Curve>& curves,
                 const std::vector<CurveCrossing>& crossings) {
    const std::vector<std::vector<Pass>> passes = passes_of(curves, crossings);
    std::vector<bool> turned(crossings.size(), false);
    choose_signs(passes, turned);
    WireBody body{label, {}};
    glm::dvec3 center(0.0);
    double count = 0.0, outward = 0.0;
    for (size_t c = 0; c < curves.size(); ++c) {
        body.curves.push_back(with_normals(curves[c], passes[c], turned));
        for (const SurfacePoint& point : body.curves.back())
            center += point.at_mm, ++count;
    }
    for (const std::vector<SurfacePoint>& curve : body.curves)
        for (const SurfacePoint& point : curve)
            outward += glm::dot(point.normal, point.at_mm - center / count);
    if (outward < 0.0)
        for (std::vector<SurfacePoint>& curve : body.curves)
            for (SurfacePoint& point : curve)
                point.normal = -point.normal;
    return body;
}

// The bodies of one label.
Result<void> add_bodies(uint16_t label, const std::vector<Curve>& curves, double near_mm,
                        std::vector<WireBody>& out) {
    std::vector<CurveCrossing> crossings;
    std::vector<size_t> parents(curves.size());
    std::iota(parents.begin(), parents.end(), size_t{0});
    std::vector<std::pair<double, size_t>> other(curves.size(), {INFINITY, 0}); // the nearest one
    for (size_t a = 0; a < curves.size(); ++a)
        for (size_t b = a + 1; b < curves.size(); ++b) {
            double least_mm = INFINITY;
            const size_t before = crossings.size();
            find_crossings(curves, a, b, near_mm, crossings, least_mm);
            other[a] = std::min(other[a], {least_mm, b});
            other[b] = std::min(other[b], {least_mm, a});
            if (crossings.size() > before)
                parents[root_of(parents, b)] = root_of(parents, a);
        }
    std::map<size_t, std::vector<size_t>> bodies;
    for (size_t c = 0; c < curves.size(); ++c)
        bodies[root_of(parents, c)].push_back(c);
    for (const auto& [root, members] : bodies) {
        if (members.size() == 1) {
            const Curve& curve = curves[members[0]];
            if (curves.size() == 1)
                return fail("curve {} is the only one of label {}: expected two or more that meet",
                            curve.number, label);
            const auto [away, to] = other[members[0]];
            return away > near_mm
                       ? fail(
                             "curve {} does not meet another one of label {}: curve {} is {:.3g} "
                             "mm away; draw one that crosses both",
                             curve.number, label, curves[to].number, away)
                       : fail(
                             "curve {} runs along curve {} and does not cross it: the surface "
                             "between them is open",
                             curve.number, curves[to].number);
        }
        std::vector<size_t> place(curves.size(), 0);
        std::vector<Curve> own;
        for (const size_t c : members) {
            place[c] = own.size();
            own.push_back(curves[c]);
        }
        std::vector<CurveCrossing> inside;
        for (CurveCrossing crossing : crossings)
            if (root_of(parents, crossing.curve[0]) == root) {
                crossing.curve = {place[crossing.curve[0]], place[crossing.curve[1]]};
                inside.push_back(crossing);
            }
        out.push_back(body_of(label, own, inside));
    }
    return {};
}

} // namespace

Result<std::vector<WireBody>> wire_bodies(const Grid& grid, std::span<const WireCurve> curves) {
    if (curves.empty())
        return fail("expected closed curves, found none");
    std::map<uint16_t, std::vector<Curve>> by_label;
    for (size_t i = 0; i < curves.size(); ++i) {
        PALPATE_TRY(Curve curve, evened(grid, curves[i], i + 1));
        by_label[curves[i].label].push_back(std::move(curve));
    }
    std::vector<WireBody> bodies;
    for (const auto& [label, own] : by_label)
        PALPATE_TRY(add_bodies(label, own, diagonal_mm(grid), bodies));
    return bodies;
}

} // namespace palpate
