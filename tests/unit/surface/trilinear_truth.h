#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <numeric>
#include <optional>
#include <vector>

// Which corners of a cell the trilinear interpolant connects, by cutting the cell up until every
// part is simple. It shares nothing with the engine.
//
// A part is simple if its corners are of one sign (then all of it is), or if the interpolant
// nowhere falls along one axis in it: the slope is bilinear, so four differences tell. Then
// whatever is inside can be moved up to the part's upper face and stays inside, and what is outside
// down to the lower one; and on a face the interpolant is bilinear, where at most two parts of a
// sign lie, in opposite quadrants about the saddle. Sizes of parts differ: each corner of any part
// that lies on another part is connected in that one, too. Every connected part on a common face
// holds a corner of the smaller face, so nothing is missed.
namespace palpate::testing {

class Union {
 public:
    explicit Union(size_t count) : parent_(count) {
        std::iota(parent_.begin(), parent_.end(), size_t{0});
    }
    size_t find(size_t i) {
        while (parent_[i] != i)
            i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void join(size_t a, size_t b) { parent_[find(a)] = find(b); }

 private:
    std::vector<size_t> parent_;
};

using Real = long double; // 64 bits: values of 24 bits at places of 3 x 12 bits are exact
__extension__ using Quad = __float128; // 113 bits: and at places of 3 x 24 bits

// No corner may be zero. Class of each corner: the least corner it is connected to.
template <class Real, int kDepth>
class TrilinearTruth {
 public:
    static constexpr int kUnits = 1 << kDepth;

    explicit TrilinearTruth(const std::array<Real, 8>& corners) : corners_(corners) {}

    // Nothing if some part is not simple at the greatest depth.
    std::optional<std::array<int, 8>> classes() {
        if (!cut({0, 0, 0}, kUnits))
            return std::nullopt;
        Union groups(nodes_.size());
        for (const Part& part : parts_)
            connect(part, groups);
        std::array<int, 8> result{};
        for (int c = 0; c < 8; ++c) {
            result[c] = c;
            for (int b = c - 1; b >= 0; --b)
                if (groups.find(node_of_corner(b)) == groups.find(node_of_corner(c)))
                    result[c] = b;
        }
        return result;
    }

 private:
    using Place = std::array<int, 3>;
    struct Part {
        Place at;
        int size;
        int axis; // along which it rises or falls; -1: of one sign
        bool rising;
        std::array<Real, 8> value;
    };
    struct Node {
        Place at;
        Real value;
    };

    Real value(const Place& p) const {
        std::array<Real, 8> v = corners_;
        for (int a = 0; a < 3; ++a)
            for (int i = 0; i < 4 >> a; ++i)
                v[i] = v[2 * i] + (v[2 * i + 1] - v[2 * i]) * p[a] / kUnits;
        return v[0];
    }
    static Place corner(const Place& at, int size, int c) {
        return {at[0] + size * (c & 1), at[1] + size * (c >> 1 & 1), at[2] + size * (c >> 2)};
    }
    size_t node_of_corner(int c) const { return number_.at(corner({0, 0, 0}, kUnits, c)); }

    bool cut(const Place& at, int size) {
        Part part{at, size, -1, false, {}};
        int inside = 0;
        for (int c = 0; c < 8; ++c) {
            part.value[c] = value(corner(at, size, c));
            inside += part.value[c] > 0;
        }
        bool simple = inside == 0 || inside == 8;
        for (int a = 0; a < 3 && !simple; ++a) {
            int up = 0, down = 0;
            for (int c = 0; c < 8; ++c)
                if (!(c >> a & 1)) {
                    up += part.value[c + (1 << a)] >= part.value[c];
                    down += part.value[c + (1 << a)] <= part.value[c];
                }
            if (up == 4 || down == 4) {
                simple = true;
                part.axis = a;
                part.rising = up == 4;
            }
        }
        if (simple) {
            for (int c = 0; c < 8; ++c) {
                const Place p = corner(at, size, c);
                if (number_.try_emplace(p, nodes_.size()).second)
                    nodes_.push_back({p, part.value[c]});
            }
            parts_.push_back(part);
            return true;
        }
        if (size == 1)
            return false;
        for (int c = 0; c < 8; ++c)
            if (!cut(corner(at, size / 2, c), size / 2))
                return false;
        return true;
    }

    // Which corner of a face (0 .. 3, u fastest) a point of the given sign is connected to.
    static int corner_on_face(const std::array<Real, 4>& f, bool inside, Real u, Real v) {
        std::array<bool, 4> same;
        int count = 0, any = -1;
        for (int c = 0; c < 4; ++c) {
            same[c] = (f[c] > 0) == inside;
            count += same[c];
            any = same[c] ? c : any;
        }
        const bool diagonal = count == 2 && same[0] == same[3];
        if (!diagonal)
            return any;
        const Real first = f[0] * f[3], second = f[1] * f[2]; // of equal signs each
        const bool joined = same[0] ? first > second : second > first;
        if (joined)
            return any;
        const Real k = f[0] + f[3] - f[1] - f[2];
        const bool beyond = u > (f[0] - f[2]) / k; // the saddle
        (void)v;
        if (same[0])
            return beyond ? 3 : 0;
        return beyond ? 1 : 2;
    }

    void connect(const Part& part, Union& groups) {
        const auto group = [&](int c) { return number_.at(corner(part.at, part.size, c)); };
        for (size_t n = 0; n < nodes_.size(); ++n) {
            const Node& node = nodes_[n];
            bool touches = true;
            for (int a = 0; a < 3; ++a)
                touches =
                    touches && node.at[a] >= part.at[a] && node.at[a] <= part.at[a] + part.size;
            if (!touches)
                continue;
            if (part.axis < 0) {
                groups.join(n, group(0));
                continue;
            }
            const bool inside = node.value > 0;
            const int a = part.axis, u = (a + 1) % 3, v = (a + 2) % 3;
            const int side = (inside == part.rising ? 1 : 0) << a;
            const std::array<int, 4> c{side, side + (1 << u), side + (1 << v),
                                       side + (1 << u) + (1 << v)};
            const auto along = [&](int axis) {
                return static_cast<Real>(node.at[axis] - part.at[axis]) / part.size;
            };
            groups.join(n, group(c[corner_on_face({part.value[c[0]], part.value[c[1]],
                                                   part.value[c[2]], part.value[c[3]]},
                                                  inside, along(u), along(v))]));
        }
    }

    std::array<Real, 8> corners_;
    std::vector<Part> parts_;
    std::vector<Node> nodes_;
    std::map<Place, size_t> number_;
};

// Finds the corners that the interpolant connects. Where a saddle's value ties with iso or nearly
// so, a part round it is simple only once its size squared, times the curvature, is below what is
// left: of ties, 2^-20. 12 cuts may not do then (one cell in some 100 000 of whole numbers), 24 do.
inline std::optional<std::array<int, 8>> trilinear_truth(const std::array<Real, 8>& corners) {
    if (const auto found = TrilinearTruth<Real, 12>(corners).classes())
        return found;
    std::array<Quad, 8> wide;
    std::copy(corners.begin(), corners.end(), wide.begin());
    return TrilinearTruth<Quad, 24>(wide).classes();
}

// Finds the corners that the six faces connect, each by its bilinear saddle.
inline std::array<int, 8> boundary_truth(const std::array<Real, 8>& d) {
    Union groups(8);
    for (int c = 0; c < 8; ++c)
        for (int a = 0; a < 3; ++a)
            if (!(c >> a & 1) && (d[c] > 0) == (d[c + (1 << a)] > 0))
                groups.join(c, c + (1 << a));
    for (int a = 0; a < 3; ++a)
        for (int side = 0; side < 2; ++side) {
            const int u = 1 << (a + 1) % 3, v = 1 << (a + 2) % 3, base = side << a;
            const Real first = d[base] * d[base + u + v], second = d[base + u] * d[base + v];
            const bool ambiguous = (d[base] > 0) == (d[base + u + v] > 0) &&
                                   (d[base + u] > 0) == (d[base + v] > 0) &&
                                   (d[base] > 0) != (d[base + u] > 0);
            if (!ambiguous)
                continue;
            first > second ? groups.join(base, base + u + v) : groups.join(base + u, base + v);
        }
    std::array<int, 8> result{};
    for (int c = 0; c < 8; ++c) {
        result[c] = c;
        for (int b = c - 1; b >= 0; --b)
            if (groups.find(b) == groups.find(c))
                result[c] = b;
    }
    return result;
}

} // namespace palpate::testing
