#pragma once

#include <glm/glm.hpp>

namespace palpate {

// The weighted sum of squared distances to planes, as a function of a point (Garland & Heckbert,
// "Surface simplification using quadric error metrics", 1997). Weights are areas, mm^2.
struct Quadric {
    double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;
    glm::dvec3 linear{0.0};
    double constant = 0.0, weight = 0.0;

    // The plane through `point` with the unit normal `n`.
    void add_plane(glm::dvec3 n, glm::dvec3 point, double w) {
        const double d = -glm::dot(n, point);
        xx += w * n.x * n.x;
        xy += w * n.x * n.y;
        xz += w * n.x * n.z;
        yy += w * n.y * n.y;
        yz += w * n.y * n.z;
        zz += w * n.z * n.z;
        linear += w * d * n;
        constant += w * d * d;
        weight += w;
    }
    Quadric operator+(const Quadric& q) const {
        return {xx + q.xx,        xy + q.xy, xz + q.xz,         yy + q.yy,
                yz + q.yz,        zz + q.zz, linear + q.linear, constant + q.constant,
                weight + q.weight};
    }
    glm::dvec3 times(glm::dvec3 p) const { // the matrix times p
        return {xx * p.x + xy * p.y + xz * p.z, xy * p.x + yy * p.y + yz * p.z,
                xz * p.x + yz * p.y + zz * p.z};
    }
    // Mean squared distance to the planes, mm^2; rounding may leave it a little off.
    double mean_square(glm::dvec3 p) const {
        const double sum = glm::dot(p, times(p)) + 2.0 * glm::dot(linear, p) + constant;
        return weight > 0.0 && sum > 0.0 ? sum / weight : 0.0;
    }
    // The point of least sum, drawn a little towards `near`, which decides where planes do not.
    glm::dvec3 lowest(glm::dvec3 near, double pull) const {
        const double w = pull * weight;
        if (!(w > 0.0))
            return near;
        const double a = xx + w, b = yy + w, c = zz + w; // symmetric, positive definite
        const glm::dvec3 r = -(times(near) + linear);    // solved for the step from `near`
        const double aa = b * c - yz * yz, ab = xz * yz - xy * c, ac = xy * yz - xz * b;
        const double bb = a * c - xz * xz, bc = xy * xz - a * yz, cc = a * b - xy * xy;
        const double determinant = a * aa + xy * ab + xz * ac;
        if (!(determinant > 0.0))
            return near;
        return near + glm::dvec3(aa * r.x + ab * r.y + ac * r.z, ab * r.x + bb * r.y + bc * r.z,
                                 ac * r.x + bc * r.y + cc * r.z) /
                          determinant;
    }
};

} // namespace palpate
