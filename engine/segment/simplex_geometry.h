#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

// Tells a vertex's place by its three neighbours a, b, c. T is double for single vertices, float
// for many at once: without branches, so that loops over it become vector instructions. Places are
// relative to the vertex. Where the neighbours lie on a line, `flat` is 1 and only `edge` and
// `middle` mean anything; lengths must not be 0 all three.
template <class T>
struct SimplexPlaces {
    T edge;                         // mean distance to the neighbours; other lengths are in it
    T middle_x, middle_y, middle_z; // of the neighbours
    T normal_x, normal_y, normal_z; // unit, of their plane
    T radius, off;                  // of their circle; of `middle` from its centre
    T height, aside;                // of the vertex over the plane; from the circle's axis
    T flat;
};

template <class T>
inline SimplexPlaces<T> simplex_places(T ax, T ay, T az, T bx, T by, T bz, T cx, T cy, T cz) {
    const auto length = [](T x, T y, T z) { return std::sqrt(x * x + y * y + z * z); };
    SimplexPlaces<T> out;
    out.edge = (length(ax, ay, az) + length(bx, by, bz) + length(cx, cy, cz)) / T(3);
    const T scale = T(1) / out.edge;
    ax *= scale, ay *= scale, az *= scale;
    const T ux = bx * scale - ax, uy = by * scale - ay, uz = bz * scale - az;
    const T vx = cx * scale - ax, vy = cy * scale - ay, vz = cz * scale - az;
    const T nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    const T squared = nx * nx + ny * ny + nz * nz;
    const T uu = ux * ux + uy * uy + uz * uz, vv = vx * vx + vy * vy + vz * vz;
    // The angle at a is less than the square root of some roundings.
    constexpr T kThin = T(16) * std::numeric_limits<T>::epsilon();
    out.flat = squared > kThin * kThin * uu * vv ? T(0) : T(1);
    const T safe = out.flat > T(0) ? T(1) : squared;
    const T by_length = T(1) / std::sqrt(safe);
    out.normal_x = nx * by_length, out.normal_y = ny * by_length, out.normal_z = nz * by_length;
    out.middle_x = ax + (ux + vx) / T(3);
    out.middle_y = ay + (uy + vy) / T(3);
    out.middle_z = az + (uz + vz) / T(3);
    const T half = T(0.5) / safe; // the circle's centre from a
    const T ox = half * (vv * (ny * uz - nz * uy) + uu * (vy * nz - vz * ny));
    const T oy = half * (vv * (nz * ux - nx * uz) + uu * (vz * nx - vx * nz));
    const T oz = half * (vv * (nx * uy - ny * ux) + uu * (vx * ny - vy * nx));
    const T px = ax + ox, py = ay + oy, pz = az + oz;
    out.radius = length(ox, oy, oz);
    out.off = length(out.middle_x - px, out.middle_y - py, out.middle_z - pz);
    out.height = -(ax * out.normal_x + ay * out.normal_y + az * out.normal_z);
    out.aside = length(out.height * out.normal_x + px, out.height * out.normal_y + py,
                       out.height * out.normal_z + pz);
    return out;
}

// Curvature of the sphere through the neighbours' circle and the vertex, per edge; 0 where flat.
template <class T>
inline T simplex_curvature(T height, T radius, T aside, T flat) {
    const T rest = aside * aside + height * height - radius * radius;
    const T below = std::sqrt(T(4) * height * height * radius * radius + rest * rest);
    return flat > T(0) || !(below > T(0)) ? T(0) : T(2) * height / below;
}

// The height over the plane, above the neighbours' middle, of a vertex with this curvature.
template <class T>
inline T simplex_height(T radius, T off, T curvature) {
    const T most = T(1) / std::max(radius, off);
    const T h = std::min(std::max(curvature, -most), most);
    const T a = std::max(T(1) - off * off * h * h, T(0));
    const T b = std::max(T(1) - radius * radius * h * h, T(0));
    const T below = std::sqrt(a) + std::sqrt(b);
    return below > T(0) ? h * (radius * radius - off * off) / below : radius;
}

} // namespace palpate
