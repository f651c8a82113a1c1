#include "engine/surface/trilinear_cell.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "engine/base/assert.h"
#include "engine/base/forest.h"

namespace palpate {

namespace {

bool is_inside(uint8_t inside, int corner) {
    return inside >> corner & 1;
}

// The bits of `bits` under `mask`, packed.
uint32_t packed(uint8_t bits, uint8_t mask) {
    uint32_t out = 0, place = 0;
    for (int i = 0; i < 8; ++i)
        if (mask >> i & 1)
            out |= static_cast<uint32_t>(bits >> i & 1) << place++;
    return out;
}

uint8_t unpacked(uint32_t bits, uint8_t mask) {
    uint8_t out = 0;
    for (int i = 0; i < 8; ++i)
        if (mask >> i & 1) {
            out |= static_cast<uint8_t>((bits & 1) << i);
            bits >>= 1;
        }
    return out;
}

// Real roots of a t^2 + b t + c. `touches`: one double root.
struct Roots {
    int count = 0;
    bool touches = false;
    std::array<double, 2> t{};
};
Roots roots_of(double a, double b, double c) {
    if (a == 0.0)
        return b == 0.0 ? Roots{} : Roots{1, false, {-c / b}};
    const double discriminant = b * b - 4.0 * a * c;
    if (discriminant == 0.0)
        return {1, true, {-0.5 * b / a}};
    if (!(discriminant > 0.0))
        return {};
    const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b)); // no cancellation
    return {2, false, {q / a, q == 0.0 ? 0.0 : c / q}};
}

using Groups = Forest<std::array<uint8_t, 48>>;

} // namespace

CornerValues corner_values(const std::array<float, 8>& values, float iso) {
    CornerValues d;
    for (int c = 0; c < 8; ++c)
        d[c] = values[c] == values[c] ? double{values[c]} - double{iso} : kNoData;
    return d;
}

uint8_t inside_corners(const CornerValues& values) {
    uint8_t inside = 0;
    for (int c = 0; c < 8; ++c)
        inside |= static_cast<uint8_t>((values[c] >= 0.0) << c);
    return inside;
}

uint8_t joined_faces(uint8_t inside, const CornerValues& values) {
    uint8_t joined = 0;
    const uint8_t ambiguous = ambiguous_faces(inside);
    for (int f = 0; f < 6; ++f) {
        if (!(ambiguous >> f & 1))
            continue;
        // Products of opposite corners: the same two numbers from either side of the face.
        const std::array<uint8_t, 4> c = face_corners(f);
        const double first = values[c[0]] * values[c[2]], second = values[c[1]] * values[c[3]];
        const bool first_inside = is_inside(inside, c[0]);
        if (first_inside ? first >= second : second >= first)
            joined |= static_cast<uint8_t>(1 << f);
    }
    return joined;
}

CornerClasses interior_classes(uint8_t inside, const CornerClasses& boundary,
                               const CornerValues& d) {
    std::array<double, 4> slope;
    std::array<double, 4> zero;            // where column k changes sign; 2 if nowhere
    std::array<double, 8> event{0.0, 1.0}; // in rising order
    int events = 2;
    const auto add_event = [&](double t) {
        if (!(t > 0.0 && t < 1.0))
            return;
        int at = events++;
        for (; event[at - 1] > t; --at)
            event[at] = event[at - 1];
        event[at] = t;
    };
    for (int k = 0; k < 4; ++k) {
        slope[k] = d[k + 4] - d[k];
        const bool changes = is_inside(inside, k) != is_inside(inside, k + 4);
        zero[k] = changes ? d[k] / (d[k] - d[k + 4]) : 2.0;
        add_event(zero[k]);
    }
    // Column 0 times column 3 minus column 1 times column 2, a quadratic in t.
    const Roots roots =
        roots_of(slope[0] * slope[3] - slope[1] * slope[2],
                 d[0] * slope[3] + d[3] * slope[0] - d[1] * slope[2] - d[2] * slope[1],
                 d[0] * d[3] - d[1] * d[2]);
    for (int r = 0; r < roots.count; ++r)
        add_event(roots.t[r]);

    Groups groups;
    constexpr int kCorner = 40; // group numbers of corners; below, 4 * slice + column
    int slices = 0;
    uint8_t before = 0; // inside columns of the slice before
    const auto add_slice = [&](uint8_t columns, double saddle) {
        const int at = 4 * slices;
        for (const auto& [a, b] : {std::pair{0, 1}, {1, 3}, {3, 2}, {2, 0}})
            if ((columns >> a & 1) == (columns >> b & 1))
                groups.join(at + a, at + b);
        if (columns == 0b1001) // inside 0 and 3
            saddle >= 0.0 ? groups.join(at, at + 3) : groups.join(at + 1, at + 2);
        if (columns == 0b0110)
            saddle <= 0.0 ? groups.join(at + 1, at + 2) : groups.join(at, at + 3);
        for (int k = 0; k < 4 && slices > 0; ++k)
            if ((columns >> k & 1) == (before >> k & 1))
                groups.join(at + k, at - 4 + k);
        before = columns;
        ++slices;
    };
    const auto saddle_at = [&](double t) {
        std::array<double, 4> column;
        for (int k = 0; k < 4; ++k)
            column[k] = d[k] + t * slope[k];
        return column[0] * column[3] - column[1] * column[2];
    };
    const auto inside_at = [&](double t) {
        uint8_t columns = 0;
        for (int k = 0; k < 4; ++k)
            columns |= static_cast<uint8_t>(is_inside(inside, t < zero[k] ? k : k + 4) << k);
        return columns;
    };
    // The two ends by themselves: a column that is zero at its end is inside there and nowhere
    // else.
    add_slice(inside & 0xf, d[0] * d[3] - d[1] * d[2]);
    for (int k = 0; k < 4; ++k)
        groups.join(kCorner + k, k);
    for (int i = 0; i + 1 < events; ++i) {
        if (event[i] == event[i + 1])
            continue;
        const double t = 0.5 * (event[i] + event[i + 1]);
        add_slice(inside_at(t), saddle_at(t));
        if (roots.touches && event[i + 1] == roots.t[0])
            add_slice(inside_at(roots.t[0]), 0.0);
    }
    add_slice(inside >> 4, d[4] * d[7] - d[5] * d[6]);
    for (int k = 0; k < 4; ++k)
        groups.join(kCorner + k + 4, 4 * (slices - 1) + k);
    // A face that the sweep sees edge on may differ by a rounding; what faces say, holds.
    for (int c = 0; c < 8; ++c)
        groups.join(kCorner + c, kCorner + boundary[c]);

    CornerClasses classes;
    for (int c = 0; c < 8; ++c) {
        classes[c] = static_cast<uint8_t>(c);
        for (int b = c - 1; b >= 0; --b)
            if (is_inside(inside, b) == is_inside(inside, c) &&
                groups.root(kCorner + b) == groups.root(kCorner + c))
                classes[c] = static_cast<uint8_t>(b);
    }
    return classes;
}

CorrectTable::CorrectTable() {
    for (int i = 0; i < 256; ++i) {
        const auto inside = static_cast<uint8_t>(i);
        const uint8_t ambiguous = ambiguous_faces(inside);
        first_[i] = static_cast<uint32_t>(entries_.size());
        needs_values_[i] = ambiguous != 0 || cell_loops(inside, 0).size() > 1;
        if (!needs_values_[i])
            continue;
        for (uint32_t subset = 0; subset < 1u << std::popcount(ambiguous); ++subset) {
            const uint8_t joined = unpacked(subset, ambiguous);
            const std::vector<CellLoop> loops = cell_loops(inside, joined);
            Entry entry{boundary_classes(inside, joined), fill_with_discs(loops), {}};
            // The classes on the inner and the outer side of each loop.
            std::vector<std::array<uint8_t, 2>> sides(loops.size());
            for (size_t l = 0; l < loops.size(); ++l) {
                const CellEdge edge = cell_edge(loops[l][0]);
                const uint8_t low = edge.corner;
                const auto high = static_cast<uint8_t>(low + (1 << edge.axis));
                sides[l] = {entry.classes[is_inside(inside, low) ? low : high],
                            entry.classes[is_inside(inside, low) ? high : low]};
            }
            for (size_t a = 0; a < loops.size(); ++a)
                for (size_t b = a + 1; b < loops.size(); ++b)
                    for (int s = 0; s < 2; ++s)
                        if (sides[a][s] == sides[b][s]) // between them; the others are connected
                            entry.tubes.push_back({std::min(sides[a][1 - s], sides[b][1 - s]),
                                                   std::max(sides[a][1 - s], sides[b][1 - s]),
                                                   fill_with_tube(loops, a, b)});
            const auto check = [](const CellSurface& s) {
                PALPATE_ASSERT_CMP(s.triangles.size(), <=, kMostTriangles);
                PALPATE_ASSERT_CMP(s.inner.size(), <=, kMostInner);
            };
            check(entry.discs);
            for (const Tube& tube : entry.tubes)
                check(tube.surface);
            entries_.push_back(std::move(entry));
        }
    }
}

const CellSurface& CorrectTable::surface(uint8_t inside, const CornerValues& values) const {
    PALPATE_ASSERT(needs_values_[inside]);
    const uint8_t joined = joined_faces(inside, values);
    const Entry& entry = entries_[first_[inside] + packed(joined, ambiguous_faces(inside))];
    if (entry.tubes.empty())
        return entry.discs;
    const CornerClasses within = interior_classes(inside, entry.classes, values);
    for (const Tube& tube : entry.tubes)
        if (within[tube.from] == within[tube.to])
            return tube.surface;
    return entry.discs;
}

size_t CorrectTable::surfaces() const {
    size_t count = 0;
    for (const Entry& entry : entries_)
        count += 1 + entry.tubes.size();
    return count;
}

const CorrectTable& correct_table() {
    static const CorrectTable table;
    return table;
}

} // namespace palpate
