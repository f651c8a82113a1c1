#include "engine/edit/shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/assert.h"

namespace palpate {

namespace {

double clamped_length(glm::dvec3 d) {
    return glm::length(glm::max(d, glm::dvec3(0.0)));
}

struct Ball : Shape {
    explicit Ball(double r) : radius(r) {}
    double signed_mm(glm::dvec3 p) const override { return glm::length(p) - radius; }
    BoxMm bounds() const override { return {glm::dvec3(-radius), glm::dvec3(radius)}; }
    std::optional<double> ball_radius_mm() const override { return radius; }
    double radius;
};

// |p / radii| has a slope of at most 1 / min(radii).
struct Ellipsoid : Shape {
    explicit Ellipsoid(glm::dvec3 r) : radii(r), smallest(std::min({r.x, r.y, r.z})) {}
    double signed_mm(glm::dvec3 p) const override {
        return (glm::length(p / radii) - 1.0) * smallest;
    }
    BoxMm bounds() const override { return {-radii, radii}; }
    glm::dvec3 radii;
    double smallest;
};

struct Capsule : Shape {
    Capsule(double r, double l) : radius(r), length(l) {}
    double signed_mm(glm::dvec3 p) const override {
        p.z -= std::clamp(p.z, 0.0, length);
        return glm::length(p) - radius;
    }
    BoxMm bounds() const override {
        return {glm::dvec3(-radius), {radius, radius, length + radius}};
    }
    double radius, length;
};

struct Cylinder : Shape {
    Cylinder(double r, double l) : radius(r), length(l) {}
    double signed_mm(glm::dvec3 p) const override {
        const glm::dvec2 d(std::sqrt(p.x * p.x + p.y * p.y) - radius,
                           std::abs(p.z - 0.5 * length) - 0.5 * length);
        return std::min(std::max(d.x, d.y), 0.0) + glm::length(glm::max(d, glm::dvec2(0.0)));
    }
    BoxMm bounds() const override { return {{-radius, -radius, 0.0}, {radius, radius, length}}; }
    double radius, length;
};

struct Block : Shape {
    explicit Block(glm::dvec3 size) : box{-0.5 * size, 0.5 * size} {}
    double signed_mm(glm::dvec3 p) const override { return box.signed_mm(p); }
    BoxMm bounds() const override { return box; }
    BoxMm box;
};

// cos and sin by their series, in one order of operations on every machine. |x| <= 2 pi, where the
// first term left out is below 1e-17.
glm::dvec2 cosine_and_sine(double x) {
    double c = 0.0, s = 0.0, term = 1.0;
    for (int n = 0; n < 44; ++n) {
        (n % 2 ? s : c) += n / 2 % 2 ? -term : term;
        term *= x / (n + 1);
    }
    return {c, s};
}

struct Burr : Shape {
    Burr(double r, uint32_t flutes, double flute_r) : radius(r), flute_radius(flute_r) {
        for (uint32_t i = 0; i < flutes; ++i)
            directions.push_back(cosine_and_sine(6.283185307179586 * i / flutes));
    }
    double signed_mm(glm::dvec3 p) const override {
        const double ball = glm::length(p) - radius;
        double nearest = std::numeric_limits<double>::infinity();
        for (const glm::dvec2 d : directions) { // half circles from pole to pole
            const double u = p.x * d.x + p.y * d.y, n = p.y * d.x - p.x * d.y;
            const double across =
                u >= 0.0 ? std::sqrt(u * u + p.z * p.z) - radius
                         : std::sqrt(u * u + (std::abs(p.z) - radius) * (std::abs(p.z) - radius));
            nearest = std::min(nearest, std::sqrt(across * across + n * n));
        }
        return std::max(ball, flute_radius - nearest);
    }
    BoxMm bounds() const override { return {glm::dvec3(-radius), glm::dvec3(radius)}; }
    double radius, flute_radius;
    std::vector<glm::dvec2> directions;
};

struct Combined : Shape {
    enum class How { any, all, first_without_others };
    Combined(How h, std::vector<ShapePtr> p) : how(h), parts(std::move(p)) {
        PALPATE_ASSERT(!parts.empty());
    }
    double signed_mm(glm::dvec3 p) const override {
        double value = parts[0]->signed_mm(p);
        for (size_t i = 1; i < parts.size(); ++i) {
            const double other = parts[i]->signed_mm(p);
            value = how == How::any   ? std::min(value, other)
                    : how == How::all ? std::max(value, other)
                                      : std::max(value, -other);
        }
        return value;
    }
    BoxMm bounds() const override {
        BoxMm box = parts[0]->bounds();
        for (const ShapePtr& part : parts) {
            const BoxMm other = part->bounds();
            if (how == How::any) {
                box.low = glm::min(box.low, other.low);
                box.high = glm::max(box.high, other.high);
            } else if (how == How::all) {
                box.low = glm::max(box.low, other.low);
                box.high = glm::max(box.low, glm::min(box.high, other.high));
            }
        }
        return box;
    }
    How how;
    std::vector<ShapePtr> parts;
};

struct Placed : Shape {
    Placed(ShapePtr s, glm::dvec3 o, glm::dquat t, double k)
        : shape(std::move(s)), offset(o), turn(glm::mat3_cast(t)), scale(k) {
        PALPATE_ASSERT(scale > 0.0);
    }
    double signed_mm(glm::dvec3 p) const override {
        return scale * shape->signed_mm((p - offset) * turn / scale); // row vector: the inverse
    }
    BoxMm bounds() const override {
        const BoxMm inner = shape->bounds();
        const glm::dvec3 middle = scale * 0.5 * (inner.low + inner.high);
        const glm::dvec3 half = scale * 0.5 * (inner.high - inner.low);
        const glm::dmat3 size(glm::abs(turn[0]), glm::abs(turn[1]), glm::abs(turn[2]));
        // Wider by what rounding may take.
        const glm::dvec3 reach = size * half + 1e-9 * (glm::abs(offset) + half + glm::abs(middle));
        return {offset + turn * middle - reach, offset + turn * middle + reach};
    }
    ShapePtr shape;
    glm::dvec3 offset;
    glm::dmat3 turn;
    double scale;
};

} // namespace

double BoxMm::signed_mm(glm::dvec3 p) const {
    const glm::dvec3 d = glm::max(low - p, p - high);
    return std::min(std::max({d.x, d.y, d.z}), 0.0) + clamped_length(d);
}

double BoxMm::reach_mm() const {
    return glm::length(glm::max(glm::abs(low), glm::abs(high)));
}

ShapePtr make_ball(double radius_mm) {
    return std::make_shared<Ball>(radius_mm);
}
ShapePtr make_ellipsoid(glm::dvec3 radii_mm) {
    return std::make_shared<Ellipsoid>(radii_mm);
}
ShapePtr make_capsule(double radius_mm, double length_mm) {
    return std::make_shared<Capsule>(radius_mm, length_mm);
}
ShapePtr make_cylinder(double radius_mm, double length_mm) {
    return std::make_shared<Cylinder>(radius_mm, length_mm);
}
ShapePtr make_box(glm::dvec3 size_mm) {
    return std::make_shared<Block>(size_mm);
}
ShapePtr make_burr(double radius_mm, uint32_t flutes, double flute_radius_mm) {
    if (flutes == 0)
        return make_ball(radius_mm);
    return std::make_shared<Burr>(radius_mm, flutes, flute_radius_mm);
}
ShapePtr make_union(std::vector<ShapePtr> parts) {
    return std::make_shared<Combined>(Combined::How::any, std::move(parts));
}
ShapePtr make_intersection(std::vector<ShapePtr> parts) {
    return std::make_shared<Combined>(Combined::How::all, std::move(parts));
}
ShapePtr make_difference(std::vector<ShapePtr> parts) {
    return std::make_shared<Combined>(Combined::How::first_without_others, std::move(parts));
}
ShapePtr make_placed(ShapePtr shape, glm::dvec3 offset_mm, glm::dquat turn, double scale) {
    return std::make_shared<Placed>(std::move(shape), offset_mm, turn, scale);
}

} // namespace palpate
