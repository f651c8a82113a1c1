#include "bench/touch/solid.h"

#include <cmath>
#include <numbers>

#include "engine/base/assert.h"

namespace palpate::touch {

namespace {

using glm::dvec3;

double normal_cdf(double x) {
    return 0.5 * std::erfc(-x / std::numbers::sqrt2);
}

// A body of which the distance is exact everywhere: density and expansion follow.
Solid from_distance(std::function<double(dvec3)> distance) {
    Solid solid;
    solid.density = [distance](dvec3 mm, double edge_mm) {
        return normal_cdf(-distance(mm) / edge_mm);
    };
    solid.distance_mm = std::move(distance);
    return solid;
}

// Half the width at which a wall blurred by edge_mm has density 0.5.
double blurred_half_width(double thickness_mm, double edge_mm) {
    const auto density = [&](double d) {
        return normal_cdf((d + thickness_mm / 2) / edge_mm) -
               normal_cdf((d - thickness_mm / 2) / edge_mm);
    };
    PALPATE_ASSERT_CMP(density(0.0), >, 0.5);
    double low = 0.0, high = thickness_mm + 4 * edge_mm;
    for (int i = 0; i < 80; ++i) {
        const double middle = 0.5 * (low + high);
        (density(middle) > 0.5 ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

dvec3 on_sphere(dvec3 center, double radius, dvec3 x) {
    return center + radius * glm::normalize(x - center);
}

} // namespace

// Force grows as depth; turning about a bulge moves the proxy R / (R - depth) for one of the hand,
// and with it the force depth / (R - depth).
double expansion(const Solid& solid, double depth) {
    const double radius = solid.bulge_mm;
    if (depth <= 0.0 || radius == INFINITY)
        return 1.0;
    return depth < radius ? std::max(1.0, depth / (radius - depth)) : INFINITY;
}

Solid grown(const Solid& body, double radius_mm) {
    Solid solid = body;
    if (!(radius_mm > 0.0))
        return solid;
    solid.distance_mm = [=](dvec3 x) { return body.distance_mm(x) - radius_mm; };
    solid.bulge_mm = body.bulge_mm + radius_mm;
    if (body.part)
        solid.part = [=](dvec3 x) {
            const double d = body.distance_mm(x) - radius_mm;
            return d >= 0.0 ? body.part(x) : -1;
        };
    if (body.nearest_free)
        solid.nearest_free = [=](dvec3 x) -> std::optional<dvec3> {
            const double d = body.distance_mm(x);
            if (d >= radius_mm)
                return x;
            // Through the surface the shortest way runs on in the same direction: on a hollow edge,
            // too, where that is rounded by the radius or more.
            const auto on_surface = body.nearest_free(x);
            if (!on_surface)
                return {};
            if (d < -1e-6)
                return *on_surface + radius_mm / -d * (*on_surface - x);
            constexpr double kStep_mm = 1e-4;
            dvec3 gradient;
            for (int axis = 0; axis < 3; ++axis) {
                dvec3 step(0.0);
                step[axis] = kStep_mm;
                gradient[axis] = body.distance_mm(x + step) - body.distance_mm(x - step);
            }
            return x + (radius_mm - d) * glm::normalize(gradient);
        };
    return solid;
}

Solid nothing(double value) {
    Solid solid = from_distance([](dvec3) { return 1e3; });
    solid.nearest_free = [](dvec3 x) -> std::optional<dvec3> { return x; };
    solid.density = [=](dvec3, double) { return value; };
    solid.free_is_convex = true;
    return solid;
}

Solid plane(dvec3 point, dvec3 normal) {
    const dvec3 n = glm::normalize(normal);
    Solid solid = from_distance([=](dvec3 x) { return glm::dot(n, x - point); });
    solid.nearest_free = [=](dvec3 x) -> std::optional<dvec3> {
        return x - std::min(glm::dot(n, x - point), 0.0) * n;
    };
    solid.free_is_convex = true;
    return solid;
}

Solid ball(dvec3 center, double radius_mm) {
    Solid solid = from_distance([=](dvec3 x) { return glm::length(x - center) - radius_mm; });
    solid.nearest_free = [=](dvec3 x) -> std::optional<dvec3> {
        const double r = glm::length(x - center);
        if (r >= radius_mm)
            return x;
        if (r < 0.02 * radius_mm)
            return {};
        return on_sphere(center, radius_mm, x);
    };
    solid.bulge_mm = radius_mm;
    return solid;
}

Solid cavity(dvec3 center, double radius_mm) {
    Solid solid = from_distance([=](dvec3 x) { return radius_mm - glm::length(x - center); });
    solid.nearest_free = [=](dvec3 x) -> std::optional<dvec3> {
        return glm::length(x - center) <= radius_mm ? x : on_sphere(center, radius_mm, x);
    };
    solid.free_is_convex = true;
    return solid;
}

dvec3 project_to_wedge(dvec3 x, dvec3 point, std::span<const dvec3> normals) {
    const auto is_inside = [&](dvec3 p) {
        for (const dvec3& n : normals)
            if (glm::dot(n, p - point) < -1e-9)
                return false;
        return true;
    };
    if (is_inside(x))
        return x;
    dvec3 best = point;
    double best_distance = glm::distance(x, point);
    const auto offer = [&](dvec3 p) {
        if (is_inside(p) && glm::distance(x, p) < best_distance) {
            best = p;
            best_distance = glm::distance(x, p);
        }
    };
    for (size_t i = 0; i < normals.size(); ++i) {
        offer(x - glm::dot(normals[i], x - point) * normals[i]);
        for (size_t j = 0; j < i; ++j) { // onto the line where two planes meet
            const dvec3 line = glm::normalize(glm::cross(normals[i], normals[j]));
            offer(point + glm::dot(line, x - point) * line);
        }
    }
    return best;
}

Solid hollow_corner(dvec3 point, std::span<const dvec3> normals, double fillet_mm) {
    const std::vector<dvec3> n(normals.begin(), normals.end());
    // The apex moved inwards so that every plane moves by fillet_mm.
    dvec3 apex = point;
    if (n.size() == 3) {
        apex += glm::inverse(glm::transpose(glm::dmat3(n[0], n[1], n[2]))) * dvec3(fillet_mm);
    } else {
        const double c = n.size() == 2 ? glm::dot(n[0], n[1]) : 0.0;
        for (const dvec3& normal : n)
            apex += fillet_mm / (n.size() == 2 ? 1.0 + c : 1.0) * normal;
    }
    const auto distance = [=](dvec3 x) {
        const double outside = glm::distance(x, project_to_wedge(x, apex, n));
        if (outside > 0.0)
            return fillet_mm - outside;
        double least = INFINITY;
        for (const dvec3& normal : n)
            least = std::min(least, glm::dot(normal, x - point));
        return least;
    };
    Solid solid = from_distance(distance);
    solid.nearest_free = [=](dvec3 x) -> std::optional<dvec3> {
        const dvec3 y = project_to_wedge(x, apex, n);
        const double outside = glm::distance(x, y);
        return outside <= fillet_mm ? x : y + fillet_mm / outside * (x - y);
    };
    solid.free_is_convex = true;
    return solid;
}

Solid solid_corner(dvec3 point, std::span<const dvec3> normals, double fillet_mm) {
    const Solid inverse = hollow_corner(point, normals, fillet_mm);
    Solid solid = from_distance([hollow = inverse.distance_mm](dvec3 x) { return -hollow(x); });
    const std::vector<dvec3> n(normals.begin(), normals.end());
    const auto distance = solid.distance_mm;
    // Unique where one face is clearly nearer than the others; on the rounded edge, too.
    solid.nearest_free = [=](dvec3 x) -> std::optional<dvec3> {
        const double d = distance(x);
        if (d >= 0.0)
            return x;
        double least = INFINITY, second = INFINITY;
        dvec3 face{};
        for (const dvec3& normal : n) {
            const double to_face = glm::dot(normal, x - point);
            if (to_face < least) {
                second = least;
                least = to_face;
                face = normal;
            } else {
                second = std::min(second, to_face);
            }
        }
        if (n.size() > 1 && second < 2.0 * least + 2.0 * fillet_mm)
            return {};
        return x - least * face;
    };
    return solid;
}

Solid slab(dvec3 point, dvec3 normal, double thickness_mm, double edge_mm) {
    const dvec3 n = glm::normalize(normal);
    const double half = blurred_half_width(thickness_mm, edge_mm);
    Solid solid = from_distance([=](dvec3 x) { return std::abs(glm::dot(n, x - point)) - half; });
    solid.density = [=](dvec3 x, double edge) {
        const double d = glm::dot(n, x - point);
        return normal_cdf((d + thickness_mm / 2) / edge) -
               normal_cdf((d - thickness_mm / 2) / edge);
    };
    solid.part = [=](dvec3 x) {
        const double d = glm::dot(n, x - point);
        return d >= half ? 0 : d <= -half ? 1 : -1;
    };
    return solid;
}

Solid shell(dvec3 center, double radius_mm, double thickness_mm, double edge_mm) {
    const double half = blurred_half_width(thickness_mm, edge_mm);
    Solid solid = from_distance(
        [=](dvec3 x) { return std::abs(glm::length(x - center) - radius_mm) - half; });
    solid.density = [=](dvec3 x, double edge) {
        const double d = glm::length(x - center) - radius_mm;
        return normal_cdf((d + thickness_mm / 2) / edge) -
               normal_cdf((d - thickness_mm / 2) / edge);
    };
    solid.part = [=](dvec3 x) {
        const double d = glm::length(x - center) - radius_mm;
        return d >= half ? 0 : d <= -half ? 1 : -1;
    };
    return solid;
}

Solid torus(dvec3 center, double ring_mm, double tube_mm) {
    const auto core = [=](dvec3 x) { // the nearest point of the centre line
        const glm::dvec2 flat(x.x - center.x, x.y - center.y);
        const double r = glm::length(flat);
        const glm::dvec2 on = r > 0.0 ? flat * (ring_mm / r) : glm::dvec2(ring_mm, 0.0);
        return center + dvec3(on, 0.0);
    };
    Solid solid = from_distance([=](dvec3 x) { return glm::distance(x, core(x)) - tube_mm; });
    solid.nearest_free = [=](dvec3 x) -> std::optional<dvec3> {
        const double r = glm::distance(x, core(x));
        if (r >= tube_mm)
            return x;
        if (r < 0.1 * tube_mm)
            return {};
        return on_sphere(core(x), tube_mm, x);
    };
    solid.bulge_mm = tube_mm;
    return solid;
}

Solid capped_cylinder(dvec3 center, dvec3 axis, double half_length_mm, double radius_mm,
                      double fillet_mm) {
    const dvec3 a = glm::normalize(axis);
    const auto parts = [=](dvec3 x) { // beyond cap and mantle of the core, moved inwards
        const double along = glm::dot(a, x - center);
        const double across = glm::length(x - center - along * a);
        return glm::dvec2(std::abs(along) - (half_length_mm - fillet_mm),
                          across - (radius_mm - fillet_mm));
    };
    Solid solid = from_distance([=](dvec3 x) {
        const glm::dvec2 q = parts(x);
        return glm::length(glm::max(q, 0.0)) + std::min(std::max(q.x, q.y), 0.0) - fillet_mm;
    });
    solid.nearest_free = [=](dvec3 x) -> std::optional<dvec3> {
        const glm::dvec2 q = parts(x);
        const double d = glm::length(glm::max(q, 0.0)) + std::min(std::max(q.x, q.y), 0.0);
        if (d >= fillet_mm)
            return x;
        const double along = glm::dot(a, x - center);
        const dvec3 out = x - center - along * a;
        // Cap or mantle, where one is clearly nearer; the other must not begin on the way.
        if (q.x - q.y > fillet_mm && q.y < 0.0)
            return x + (fillet_mm - q.x) * (along < 0.0 ? -a : a);
        if (q.y - q.x > fillet_mm && q.x < 0.0 && glm::length(out) > 0.1 * radius_mm)
            return x + (fillet_mm - q.y) * glm::normalize(out);
        return {};
    };
    return solid;
}

Solid two_balls(dvec3 a, dvec3 b, double radius_mm) {
    Solid solid = from_distance(
        [=](dvec3 x) { return std::min(glm::distance(x, a), glm::distance(x, b)) - radius_mm; });
    return solid;
}

Solid gyroid(double period_mm) {
    const double k = 2.0 * std::numbers::pi / period_mm;
    Solid solid = from_distance([=](dvec3 mm) {
        const dvec3 s = glm::sin(k * mm), c = glm::cos(k * mm);
        const double value = s.x * c.y + s.y * c.z + s.z * c.x;
        const dvec3 gradient =
            k * dvec3(c.x * c.y - s.z * s.x, c.y * c.z - s.x * s.y, c.z * c.x - s.y * s.z);
        return -value / std::max(glm::length(gradient), 0.2 * k);
    });
    return solid;
}

std::vector<dvec3> wedge_normals(double angle_deg, dvec3 up, dvec3 along) {
    const dvec3 u = glm::normalize(up);
    const dvec3 side = glm::normalize(glm::cross(along, u));
    // A half space whose face leans by half the angle from `up` has its normal half the angle from
    // `side`.
    const double half = angle_deg * std::numbers::pi / 360.0;
    return {std::cos(half) * side + std::sin(half) * u,
            -std::cos(half) * side + std::sin(half) * u};
}

} // namespace palpate::touch
