#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/edit/operation.h"
#include "engine/edit/sweep.h"
#include "tests/unit/edit/random_edit.h"

// Every operation once more, on a flat array, straight from its definition: slow, obviously right.
namespace palpate {

struct FlatVolume {
    Grid grid;
    std::vector<double> values;

    explicit FlatVolume(const Volume& volume) : grid(volume.grid()) {
        for_each([&](glm::ivec3 i) { values.push_back(volume.value(glm::uvec3(i))); });
    }
    bool has(glm::ivec3 i) const {
        return glm::all(glm::greaterThanEqual(i, glm::ivec3(0))) &&
               glm::all(glm::lessThan(i, glm::ivec3(grid.size)));
    }
    size_t at(glm::ivec3 i) const {
        return i.x + size_t(grid.size.x) * (i.y + size_t(grid.size.y) * i.z);
    }
    double operator[](glm::ivec3 i) const { return values[at(i)]; }

    template <class Visit>
    void for_each(Visit&& visit) const {
        for (int z = 0; z < int(grid.size.z); ++z)
            for (int y = 0; y < int(grid.size.y); ++y)
                for (int x = 0; x < int(grid.size.x); ++x)
                    visit(glm::ivec3(x, y, z));
    }
};

// Whether a tool that moves holds a sample. The ball's sweep is worked out here; of other shapes it
// is asked of the sweep, whose own tests hold it against their motion.
inline bool holds(const Tool& tool, const Grid& grid, const StrokePose& from, const StrokePose& to,
                  glm::ivec3 index) {
    if (tool.marks_origin && passes_cell(grid, from, to, glm::dvec3(index)))
        return true;
    if (!tool.shape)
        return false;
    const glm::dvec3 origin(grid.world_from_index[3]);
    const glm::dvec3 p = glm::dmat3(grid.world_from_index) * glm::dvec3(index);
    if (const auto radius = tool.shape->ball_radius_mm()) {
        const glm::dvec3 a = from.tool.position_mm - origin,
                         d = to.tool.position_mm - from.tool.position_mm;
        const double dd = glm::dot(d, d);
        const double t = dd > 0.0 ? std::clamp(glm::dot(p - a, d) / dd, 0.0, 1.0) : 0.0;
        return glm::length(p - a - t * d) <= *radius;
    }
    return Sweep(tool, grid, from, to).at(p).inside;
}

// The distance from a tool that moves and, of a ball by its gradient, the most that it changes
// from sample to sample; of other shapes the sweep is asked.
inline Sweep::Near near(const Tool& tool, const Grid& grid, const StrokePose& from,
                        const StrokePose& to, glm::ivec3 index) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    if (tool.marks_origin && passes_cell(grid, from, to, glm::dvec3(index)))
        return {-kInfinity, 1.0};
    if (!tool.shape)
        return {kInfinity, 1.0};
    const glm::dmat3 axes(grid.world_from_index);
    const glm::dvec3 p = axes * glm::dvec3(index);
    const auto radius = tool.shape->ball_radius_mm();
    if (!radius)
        return Sweep(tool, grid, from, to).near(p);
    const glm::dvec3 a = from.tool.position_mm - glm::dvec3(grid.world_from_index[3]),
                     d = to.tool.position_mm - from.tool.position_mm;
    const double dd = glm::dot(d, d);
    const double t = dd > 0.0 ? std::clamp(glm::dot(p - a, d) / dd, 0.0, 1.0) : 0.0;
    const glm::dvec3 away = p - a - t * d;
    const double length = glm::length(away);
    double most = 0.0, longest = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        most = std::max(most, std::abs(glm::dot(away, axes[axis])) / length);
        longest = std::max(longest, glm::length(axes[axis]));
    }
    return {length - *radius, length > 0.0 ? most : longest};
}

inline double depth(const Tool& tool, const Grid& grid, const StrokePose& pose, glm::ivec3 index) {
    if (tool.marks_origin && passes_cell(grid, pose, pose, glm::dvec3(index)))
        return std::numeric_limits<double>::infinity();
    if (!tool.shape)
        return -1.0;
    const glm::dvec3 p = world_point(grid, glm::dvec3(index));
    return -tool.shape->signed_mm((p - pose.tool.position_mm) * glm::mat3_cast(pose.tool.rotation));
}

inline FlatVolume brute_force(const Volume& before, const Tool& tool, const Operation& op,
                              const std::vector<StrokePose>& poses, const Volume* guide) {
    const FlatVolume s(before);
    FlatVolume out = s;
    const auto rounded = [&](double v) {
        return visit_scalar(before.type(), [&](auto t) {
            using T = decltype(t);
            if constexpr (std::is_same_v<T, float>)
                return double(float(v));
            else
                return std::clamp<double>(std::nearbyint(v), std::numeric_limits<T>::min(),
                                          std::numeric_limits<T>::max());
        });
    };
    // By hand: three straight pieces whose middle one crosses the surface at its share.
    const auto taken = [&](double v, double samples) {
        const double to = *op.to_value;
        double at = 0.5;
        if (op.surface_value && v != to) {
            const double share = (*op.surface_value - v) / (to - v);
            at = share >= 1.0 || share <= 0.0 ? 0.5 : share;
        }
        const double k = at < 0.5 ? at : 1.0 - at;
        double share = at - k * samples;
        if (samples > 1.0)
            share = samples < 2.0 ? (at - k) * (2.0 - samples) : 0.0;
        if (samples < -1.0)
            share = samples > -2.0 ? 1.0 - (1.0 - at - k) * (2.0 + samples) : 1.0;
        return share < 1.0 ? v + share * (to - v) : to;
    };
    const auto counts = [&](glm::ivec3 i) { // by label and by value
        if (op.area.kind != EditArea::Kind::everywhere) {
            const double there = op.on_labels() ? s[i] : double(guide->value(glm::uvec3(i)));
            bool named = op.area.labels.empty() && there != 0.0;
            for (const uint16_t label : op.area.labels)
                named = named || there == label;
            if (named != (op.area.kind == EditArea::Kind::inside))
                return false;
        }
        if (!op.only_values)
            return true;
        const double v = op.on_labels() ? double(guide->value(glm::uvec3(i))) : s[i];
        return v >= op.only_values->first && v <= op.only_values->second;
    };
    if (op.kind == OperationKind::mill) {
        const glm::dvec3 spacing = spacing_mm(s.grid);
        const double half = 0.5 * std::min({spacing.x, spacing.y, spacing.z});
        const double reach = tool.shape ? tool.shape->bounds().reach_mm() : 0.0;
        const double longest = std::max({spacing.x, spacing.y, spacing.z});
        std::vector<double> dose(s.values.size());
        std::vector<float> samples(s.values.size(), 2.0f);
        for (size_t k = 1; k < poses.size(); ++k) {
            const double seconds = poses[k].time_s - poses[k - 1].time_s;
            const double n =
                std::max(1.0, std::ceil(travel_mm(poses[k - 1], poses[k], reach) / half));
            for (double part = 0; part < n; ++part) {
                const StrokePose pose = pose_between(poses[k - 1], poses[k], (part + 0.5) / n);
                s.for_each([&](glm::ivec3 i) {
                    if (op.walls == Walls::samples) {
                        dose[s.at(i)] += depth_weight(depth(tool, s.grid, pose, i), op.falloff_mm) *
                                         (seconds / n);
                        return;
                    }
                    const Sweep::Near here = near(tool, s.grid, pose, pose, i);
                    const double weight = depth_weight(-here.mm, op.falloff_mm, longest);
                    if (weight > 0.0 && here.samples() < 2.0) {
                        dose[s.at(i)] += weight * (seconds / n);
                        samples[s.at(i)] = std::min(samples[s.at(i)], float(here.samples()));
                    }
                });
            }
        }
        s.for_each([&](glm::ivec3 i) {
            const double v = s[i];
            if (std::isnan(v) || !counts(i) || dose[s.at(i)] == 0.0)
                return;
            // By hand: interpolate the rate, then move.
            double rate = op.rates.front().per_s;
            for (size_t r = 0; r + 1 < op.rates.size(); ++r) {
                const auto [v0, r0] = op.rates[r];
                const auto [v1, r1] = op.rates[r + 1];
                if (v > v0)
                    rate = v >= v1 ? r1 : r0 + (v - v0) / (v1 - v0) * (r1 - r0);
            }
            const double by = rate * dose[s.at(i)];
            const double end =
                op.walls == Walls::smooth ? taken(v, double(samples[s.at(i)])) : *op.to_value;
            out.values[s.at(i)] = rounded(v > end ? std::max(end, v - by) : std::min(end, v + by));
        });
        return out;
    }
    if (op.smooth_walls()) {
        s.for_each([&](glm::ivec3 i) {
            float samples = 2.0f;
            for (size_t k = 0; k < poses.size(); ++k)
                samples = std::min(
                    samples,
                    float(near(tool, s.grid, poses[k > 0 ? k - 1 : 0], poses[k], i).samples()));
            if (!std::isnan(s[i]) && samples < 2.0f && counts(i))
                out.values[s.at(i)] = rounded(taken(s[i], samples));
        });
        return out;
    }
    std::vector<bool> t(s.values.size());
    s.for_each([&](glm::ivec3 i) {
        bool in = false;
        for (size_t k = 0; k < poses.size() && !in; ++k)
            in = holds(tool, s.grid, poses[k > 0 ? k - 1 : 0], poses[k], i);
        t[s.at(i)] = in && counts(i);
    });
    const auto neighbours = [&](glm::ivec3 i) {
        std::vector<glm::ivec3> found;
        for (int z = -1; z <= 1; ++z)
            for (int y = -1; y <= 1; ++y)
                for (int x = -1; x <= 1; ++x) {
                    const int axes = std::abs(x) + std::abs(y) + std::abs(z);
                    const int most = op.neighbours == 6 ? 1 : op.neighbours == 18 ? 2 : 3;
                    if (axes >= 1 && axes <= most && s.has(i + glm::ivec3(x, y, z)))
                        found.push_back(i + glm::ivec3(x, y, z));
                }
        return found;
    };
    const double label = op.label;
    const auto is_free = [&](double v) {
        if (!op.over)
            return true;
        for (const uint16_t o : *op.over)
            if (v == o)
                return true;
        return false;
    };
    const auto change = [&](glm::ivec3 i) -> double {
        const double v = s[i];
        switch (op.kind) {
            case OperationKind::draw:
                return is_free(v) ? label : v;
            case OperationKind::erase:
                return is_free(v) ? 0.0 : v;
            case OperationKind::cut:
                return std::isnan(v) ? v : rounded(*op.to_value);
            case OperationKind::erode: {
                bool at_edge = false;
                for (const glm::ivec3 n : neighbours(i))
                    at_edge = at_edge || s[n] != label;
                return v == label && at_edge ? 0.0 : v;
            }
            case OperationKind::dilate: {
                bool beside = false;
                for (const glm::ivec3 n : neighbours(i))
                    beside = beside || s[n] == label;
                return v != label && beside && is_free(v) ? label : v;
            }
            case OperationKind::smooth: {
                int of_label = 0, all = 0;
                const glm::dmat3 mm(s.grid.world_from_index);
                const glm::dvec3 spacing = spacing_mm(s.grid);
                const glm::ivec3 reach(glm::ceil(op.radius_mm / spacing) + 1.0);
                for (int z = -reach.z; z <= reach.z; ++z)
                    for (int y = -reach.y; y <= reach.y; ++y)
                        for (int x = -reach.x; x <= reach.x; ++x)
                            if (const glm::ivec3 d(x, y, z);
                                glm::length(mm * glm::dvec3(d)) <= op.radius_mm && s.has(i + d)) {
                                ++all;
                                of_label += s[i + d] == label;
                            }
                if (2 * of_label > all && is_free(v))
                    return label;
                return 2 * of_label < all && v == label ? 0.0 : v;
            }
            default:
                return v;
        }
    };
    s.for_each([&](glm::ivec3 i) {
        if (t[s.at(i)])
            out.values[s.at(i)] = change(i);
    });
    if (!op.by_region())
        return out;
    const bool fill = op.kind == OperationKind::fill;
    const auto member = [&](glm::ivec3 i) { return (s[i] == label) != fill; };
    std::vector<bool> seen(s.values.size());
    s.for_each([&](glm::ivec3 seed) {
        if (!t[s.at(seed)] || !member(seed) || seen[s.at(seed)])
            return;
        std::vector<glm::ivec3> part{seed};
        seen[s.at(seed)] = true;
        bool open = false;
        for (size_t k = 0; k < part.size(); ++k) {
            for (int axis = 0; axis < 3; ++axis)
                open =
                    open ||
                    (fill && (part[k][axis] == 0 || part[k][axis] == int(s.grid.size[axis]) - 1));
            for (const glm::ivec3 n : neighbours(part[k])) {
                if (!member(n))
                    continue;
                if (!t[s.at(n)])
                    open = true;
                else if (!seen[s.at(n)]) {
                    seen[s.at(n)] = true;
                    part.push_back(n);
                }
            }
        }
        const double mm3 =
            std::abs(glm::determinant(glm::dmat3(s.grid.world_from_index))) * double(part.size());
        if (open || (!fill && mm3 >= op.smallest_mm3))
            return;
        for (const glm::ivec3 i : part)
            if (!fill)
                out.values[s.at(i)] = 0.0;
            else if (is_free(s[i]))
                out.values[s.at(i)] = label;
    });
    return out;
}

// Labels 0 .. 3 in overlapping balls of chance, with some noise: edges, holes and specks.
inline Volume random_labels(Random& random, const Grid& grid, ScalarType type) {
    struct Blob {
        glm::dvec3 center;
        double radius;
        int label;
    };
    std::vector<Blob> blobs;
    for (int i = 0; i < 12; ++i)
        blobs.push_back(
            {glm::dvec3(uniform(random, 0, grid.size.x), uniform(random, 0, grid.size.y),
                        uniform(random, 0, grid.size.z)),
             uniform(random, 3, 12), pick(random, 0, 3)});
    const uint64_t salt = random();
    return make_volume(grid, type, [=](glm::uvec3 i) -> double {
        uint64_t h = (i.x * 73856093u) ^ (i.y * 19349663u) ^ (i.z * 83492791u) ^ salt;
        h = (h ^ h >> 31) * 0x9e3779b97f4a7c15u;
        if (h >> 56 < 8)
            return double(h >> 40 & 3);
        double label = 0;
        for (const Blob& blob : blobs)
            if (glm::length(glm::dvec3(i) - blob.center) < blob.radius)
                label = blob.label;
        return label;
    });
}

inline Volume random_greys(Random& random, const Grid& grid, ScalarType type) {
    const uint64_t salt = random();
    const bool signed_type = type == ScalarType::i16 || type == ScalarType::f32;
    const bool gaps = type == ScalarType::f32 && pick(random, 0, 1);
    return make_volume(grid, type, [=](glm::uvec3 i) {
        uint64_t h = (i.x * 73856093u) ^ (i.y * 19349663u) ^ (i.z * 83492791u) ^ salt;
        h = (h ^ h >> 31) * 0x9e3779b97f4a7c15u;
        if (gaps && h >> 58 == 0)
            return std::numeric_limits<double>::quiet_NaN();
        const double most = type == ScalarType::u8 || type == ScalarType::i8 ? 100 : 2000;
        return double(h >> 40 & 0xffff) / 65535.0 * most - (signed_type ? 1000.0 : 0.0);
    });
}

inline EditArea random_area(Random& random) {
    EditArea area{pick(random, 0, 1) ? EditArea::Kind::inside : EditArea::Kind::outside, {}};
    for (uint16_t label = 1; label < 4; ++label)
        if (pick(random, 0, 1))
            area.labels.push_back(label);
    return area;
}

inline Operation random_operation(Random& random, OperationKind kind) {
    Operation op;
    op.kind = kind;
    op.label = uint16_t(pick(random, 1, 3));
    constexpr int kNeighbours[] = {6, 18, 26};
    op.neighbours = kNeighbours[pick(random, 0, 2)];
    if (pick(random, 0, 2) == 0) {
        op.over.emplace();
        for (uint16_t label = 0; label < 4; ++label)
            if (pick(random, 0, 1))
                op.over->push_back(label);
    }
    op.radius_mm = uniform(random, 0.5, 3.0);
    op.smallest_mm3 = uniform(random, 0.0, 40.0);
    if (pick(random, 0, 2) == 0)
        op.only_values = {uniform(random, -800, 0), uniform(random, 0, 900)};
    op.to_value = uniform(random, 0, 127); // which every type holds
    op.walls = pick(random, 0, 2) ? Walls::smooth : Walls::samples;
    if (op.smooth_walls() && pick(random, 0, 1))
        op.surface_value = uniform(random, -300, 300);
    op.falloff_mm = pick(random, 0, 1) ? 0.0 : uniform(random, 0.2, 3.0);
    op.rates = {{-500, uniform(random, 0, 2e5)}};
    if (pick(random, 0, 1)) {
        op.rates.push_back({100, uniform(random, 0, 2e5)});
        op.rates.push_back({900, uniform(random, 0, 2e5)});
    }
    Random of_area = random; // what is drawn next is as without an area
    if (op.on_labels() && pick(of_area, 0, 2) == 0)
        op.area = random_area(of_area);
    return op;
}

} // namespace palpate
