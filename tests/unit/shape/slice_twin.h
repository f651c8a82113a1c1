#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <vector>

#include "tests/unit/shape/random_labels.h"

// interpolate_slices() by its definition, sample by sample, slowly and in double precision.
namespace palpate::slice_twin {

// A slice: samples (x, y), x fastest.
struct Slice {
    glm::ivec2 size;
    std::vector<bool> has;

    size_t place(glm::ivec2 at) const { return size_t(at.x) + size_t(size.x) * size_t(at.y); }
    bool at(glm::ivec2 p) const {
        return p.x >= 0 && p.y >= 0 && p.x < size.x && p.y < size.y && has[place(p)];
    }
    template <class Visit>
    void each(const Visit& visit) const {
        for (int y = 0; y < size.y; ++y)
            for (int x = 0; x < size.x; ++x)
                visit(glm::ivec2(x, y));
    }
    double count() const { return double(std::count(has.begin(), has.end(), true)); }
    glm::dvec2 centroid() const {
        glm::dvec2 sum(0.0);
        each([&](glm::ivec2 p) { sum += at(p) ? glm::dvec2(p) : glm::dvec2(0.0); });
        return sum / count();
    }
};

inline bool overlap(const Slice& a, const Slice& b) {
    for (size_t i = 0; i < a.has.size(); ++i)
        if (a.has[i] && b.has[i])
            return true;
    return false;
}

inline Slice united(const std::vector<Slice>& parts, glm::ivec2 size) {
    Slice all{size, std::vector<bool>(size_t(size.x) * size_t(size.y))};
    for (const Slice& part : parts)
        for (size_t i = 0; i < part.has.size(); ++i)
            all.has[i] = all.has[i] || part.has[i];
    return all;
}

// Grows from the first sample that is left until nothing is added.
inline std::vector<Slice> pieces(Slice left) {
    std::vector<Slice> out;
    while (left.count() > 0) {
        Slice piece{left.size, std::vector<bool>(left.has.size())};
        piece.has[size_t(std::find(left.has.begin(), left.has.end(), true) - left.has.begin())] =
            true;
        for (double before = 0; before != piece.count();) {
            before = piece.count();
            left.each([&](glm::ivec2 p) {
                for (int n = 0; n < 9; ++n)
                    if (left.at(p) && piece.at(p + glm::ivec2(n % 3 - 1, n / 3 - 1)))
                        piece.has[piece.place(p)] = true;
            });
        }
        for (size_t i = 0; i < left.has.size(); ++i)
            left.has[i] = left.has[i] && !piece.has[i];
        out.push_back(std::move(piece));
    }
    return out;
}

struct Group {
    std::vector<Slice> a, b;
};

inline std::vector<Group> groups(std::vector<Slice> a, std::vector<Slice> b, glm::dvec2 spacing) {
    std::vector<Group> all;
    for (Slice& piece : a)
        all.push_back({{piece}, {}});
    for (Slice& piece : b)
        all.push_back({{}, {piece}});
    const auto belong = [](const Group& one, const Group& other) {
        for (const Slice& a_piece : one.a)
            for (const Slice& b_piece : other.b)
                if (overlap(a_piece, b_piece))
                    return true;
        return false;
    };
    const auto join = [&](size_t i, size_t j) {
        all[i].a.insert(all[i].a.end(), all[j].a.begin(), all[j].a.end());
        all[i].b.insert(all[i].b.end(), all[j].b.begin(), all[j].b.end());
        all.erase(all.begin() + ptrdiff_t(j));
    };
    for (bool changed = true; changed;) {
        changed = false;
        for (size_t i = 0; i < all.size() && !changed; ++i)
            for (size_t j = i + 1; j < all.size() && !changed; ++j)
                if (belong(all[i], all[j]) || belong(all[j], all[i])) {
                    join(i, j);
                    changed = true;
                }
    }
    for (;;) { // the nearest two that are alone
        double nearest = std::numeric_limits<double>::infinity();
        std::pair<size_t, size_t> found;
        for (size_t i = 0; i < all.size(); ++i)
            for (size_t j = 0; j < all.size(); ++j) {
                if (!all[i].b.empty() || !all[j].a.empty() || i == j)
                    continue;
                const Slice &one = all[i].a[0], &other = all[j].b[0];
                const double mm = glm::length((one.centroid() - other.centroid()) * spacing);
                const auto diameter = [&](const Slice& piece) {
                    return std::sqrt(piece.count() * spacing.x * spacing.y / std::acos(-1.0)) * 2;
                };
                if (mm <= diameter(one) + diameter(other) && mm < nearest) {
                    nearest = mm;
                    found = {i, j};
                }
            }
        if (!(nearest < std::numeric_limits<double>::infinity()))
            return all;
        join(found.first, found.second);
    }
}

// Negative in the set, to the nearest sample of the other kind.
inline std::vector<double> distances(const Slice& set, glm::dvec2 spacing) {
    std::vector<double> out(set.has.size(), glm::length(glm::dvec2(set.size) * spacing));
    set.each([&](glm::ivec2 p) {
        double& mm = out[set.place(p)];
        set.each([&](glm::ivec2 q) {
            if (set.at(p) != set.at(q))
                mm = std::min(mm, glm::length(glm::dvec2(p - q) * spacing));
        });
        mm *= set.at(p) ? -1.0 : 1.0;
    });
    return out;
}

inline double linear(const Slice& slice, const std::vector<double>& mm, glm::dvec2 p) {
    p = glm::clamp(p, glm::dvec2(0.0), glm::dvec2(slice.size) - 1.0);
    double sum = 0.0;
    for (int n = 0; n < 4; ++n) {
        const glm::ivec2 q = glm::ivec2(glm::floor(p)) + glm::ivec2(n % 2, n / 2);
        const glm::dvec2 off = 1.0 - glm::abs(glm::dvec2(q) - p);
        if (off.x > 0.0 && off.y > 0.0)
            sum += off.x * off.y * mm[slice.place(glm::min(q, slice.size - 1))];
    }
    return sum;
}

// The least blend of a label at every sample of the slices between two.
inline std::vector<double> blends(const Slice& a, const Slice& b, glm::dvec2 spacing,
                                  double share) {
    std::vector<double> out(a.has.size(), std::numeric_limits<double>::infinity());
    for (const Group& group : groups(pieces(a), pieces(b), spacing)) {
        const bool alone = group.a.empty() || group.b.empty();
        const Slice of_a = group.a.empty() ? a : united(group.a, a.size),
                    of_b = group.b.empty() ? b : united(group.b, b.size);
        glm::dvec2 way(0.0);
        if (!alone)
            way = glm::round((of_b.centroid() - of_a.centroid()) * 64.0) / 64.0;
        const std::vector<double> mm_a = distances(of_a, spacing), mm_b = distances(of_b, spacing);
        a.each([&](glm::ivec2 p) {
            if (alone && !(group.a.empty() ? of_b : of_a).at(p))
                return;
            const double blend = (1.0 - share) * linear(a, mm_a, glm::dvec2(p) - share * way) +
                                 share * linear(b, mm_b, glm::dvec2(p) + (1.0 - share) * way);
            out[a.place(p)] = std::min(out[a.place(p)], blend);
        });
    }
    return out;
}

} // namespace palpate::slice_twin
