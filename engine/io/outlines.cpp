#include "engine/io/outlines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace palpate::io {

namespace {

constexpr uint32_t kNoCorner = std::numeric_limits<uint32_t>::max();

// The box of the samples with a label, and whether a sample in it has it.
struct Mask {
    glm::ivec2 low{}, size{};
    std::vector<uint8_t> set;

    bool at(int x, int y) const {
        return x >= 0 && y >= 0 && x < size.x && y < size.y &&
               set[static_cast<size_t>(y) * static_cast<size_t>(size.x) + static_cast<size_t>(x)];
    }
};

Mask mask_of(std::span<const uint16_t> slice, glm::uvec2 size, uint16_t label) {
    const auto index = [&](int x, int y) { return static_cast<size_t>(y) * size.x + size_t(x); };
    glm::ivec2 low(size), high(-1);
    for (int y = 0; y < static_cast<int>(size.y); ++y)
        for (int x = 0; x < static_cast<int>(size.x); ++x)
            if (slice[index(x, y)] == label) {
                low = glm::min(low, glm::ivec2(x, y));
                high = glm::max(high, glm::ivec2(x, y));
            }
    Mask mask;
    if (high.x < 0)
        return mask;
    mask.low = low;
    mask.size = high - low + 1;
    for (int y = low.y; y <= high.y; ++y)
        for (int x = low.x; x <= high.x; ++x)
            mask.set.push_back(slice[index(x, y)] == label ? 1 : 0);
    return mask;
}

// A corner of a loop, in half samples, and the corner that follows.
struct Corner {
    glm::ivec2 at;
    uint32_t next = kNoCorner;
};

// Walks around samples with them on the right hand, y downwards: along the
// upper side of a sample to the right, along its right side down, and so on.
// A walk round samples stays with its own where two of them meet at a corner alone.
class Tracer {
 public:
    explicit Tracer(const Mask& mask)
        : mask_(mask),
          corner_of_(4 * static_cast<size_t>(mask.size.x) * static_cast<size_t>(mask.size.y),
                     kNoCorner) {}

    // Every loop, by its first corner, that of the holes apart. A hole is named
    // by the left one of its sides that are farthest to the left.
    void trace() {
        for (int y = 0; y < mask_.size.y; ++y)
            for (int x = 0; x < mask_.size.x; ++x)
                for (int side = 0; side < 4; ++side)
                    if (is_side(x, y, side) && corner_of_[key(x, y, side)] == kNoCorner)
                        trace_from(x, y, side);
    }

    // Joins every hole to what lies to its left. From the left to the right, so
    // that what is joined is joined already.
    void join_holes() {
        std::sort(holes_.begin(), holes_.end(), [](const glm::ivec2& a, const glm::ivec2& b) {
            return std::pair(a.x, a.y) < std::pair(b.x, b.y);
        });
        for (const glm::ivec2 at : holes_) {
            int left = at.x; // the sample left of the hole, then the first of its run
            while (mask_.at(left - 1, at.y))
                --left;
            const uint32_t hole = corner_of_[key(at.x, at.y, kRight)];
            const uint32_t outer = corner_of_[key(left, at.y, kLeft)];
            const int middle = 2 * at.y; // of the row, in half samples
            const uint32_t here = add({2 * left - 1, middle}), there = add({2 * at.x + 1, middle});
            const uint32_t back = add({2 * at.x + 1, middle}), home = add({2 * left - 1, middle});
            corners_[home].next = corners_[outer].next;
            corners_[there].next = corners_[hole].next;
            corners_[outer].next = here;
            corners_[here].next = there;
            corners_[hole].next = back;
            corners_[back].next = home;
        }
    }

    std::vector<Outline> outlines() const {
        std::vector<Outline> all;
        for (const uint32_t start : outer_) {
            std::vector<glm::ivec2> points;
            uint32_t at = start;
            do {
                points.push_back(corners_[at].at);
                at = corners_[at].next;
            } while (at != start);
            Outline& outline = all.emplace_back();
            for (size_t i = 0; i < points.size(); ++i) {
                const glm::ivec2 before = points[(i + points.size() - 1) % points.size()];
                const glm::ivec2 after = points[(i + 1) % points.size()];
                if (glm::sign(points[i] - before) != glm::sign(after - points[i])) // a turn
                    outline.push_back(glm::dvec2(points[i]) * 0.5 + glm::dvec2(mask_.low));
            }
        }
        return all;
    }

 private:
    static constexpr int kRight = 1, kLeft = 3; // upper, right, lower, left
    static constexpr std::array<glm::ivec2, 4> kAlong{{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};
    static constexpr std::array<glm::ivec2, 4> kOut{{{0, -1}, {1, 0}, {0, 1}, {-1, 0}}};
    static constexpr std::array<glm::ivec2, 4> kStart{{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};

    bool is_side(int x, int y, int side) const {
        const glm::ivec2 out = kOut[size_t(side)];
        return mask_.at(x, y) && !mask_.at(x + out.x, y + out.y);
    }
    size_t key(int x, int y, int side) const {
        return 4 * (static_cast<size_t>(y) * static_cast<size_t>(mask_.size.x) + size_t(x)) +
               size_t(side);
    }
    uint32_t add(glm::ivec2 at) {
        corners_.push_back({at, kNoCorner});
        return static_cast<uint32_t>(corners_.size() - 1);
    }

    void trace_from(int x, int y, int side) {
        const auto first = static_cast<uint32_t>(corners_.size());
        const glm::ivec2 start(x, y);
        const int start_side = side;
        int64_t twice_area = 0;
        glm::ivec2 leftmost(std::numeric_limits<int>::max()); // a right side
        glm::ivec2 at = start;
        do {
            const glm::ivec2 corner = 2 * at + kStart[size_t(side)];
            const uint32_t added = add(corner);
            corner_of_[key(at.x, at.y, side)] = added;
            if (added > first)
                corners_[added - 1].next = added;
            const glm::ivec2 end = corner + 2 * kAlong[size_t(side)];
            twice_area += int64_t{corner.x} * end.y - int64_t{end.x} * corner.y;
            if (side == kRight && std::pair(at.x, at.y) < std::pair(leftmost.x, leftmost.y))
                leftmost = at;
            const glm::ivec2 ahead = at + kAlong[size_t(side)];
            const glm::ivec2 across = ahead + kOut[size_t(side)];
            if (!mask_.at(ahead.x, ahead.y)) {
                side = (side + 1) % 4;
            } else if (!mask_.at(across.x, across.y)) {
                at = ahead;
            } else {
                at = across;
                side = (side + 3) % 4;
            }
        } while (at != start || side != start_side);
        corners_.back().next = first;
        if (twice_area > 0)
            outer_.push_back(first);
        else
            holes_.push_back(leftmost);
    }

    const Mask& mask_;
    std::vector<uint32_t> corner_of_; // by side of a sample: the corner at which it begins
    std::vector<Corner> corners_;
    std::vector<uint32_t> outer_;
    std::vector<glm::ivec2> holes_;
};

// Adds what lies to the right of an edge, in each sample of the rows that it
// crosses; summed along a row this is the enclosed area, with the sign of the
// direction. `sums` has a sample more in each row.
void add_edge(glm::dvec2 from, glm::dvec2 to, glm::uvec2 size, std::vector<double>& sums) {
    if (from.y == to.y)
        return;
    const double sign = from.y < to.y ? 1.0 : -1.0;
    if (from.y > to.y)
        std::swap(from, to);
    const double slope = (to.x - from.x) / (to.y - from.y);
    const double first = std::max(from.y, 0.0), last = std::min(to.y, double(size.y));
    if (!(first < last)) // beyond the slice, however far
        return;
    for (auto row = static_cast<int64_t>(std::floor(first)); double(row) < last; ++row) {
        const double top = std::max(first, double(row)), bottom = std::min(last, double(row + 1));
        if (!(bottom > top))
            continue;
        double x0 = from.x + (top - from.y) * slope, x1 = from.x + (bottom - from.y) * slope;
        if (x0 > x1)
            std::swap(x0, x1);
        const double height = sign * (bottom - top);
        double* const out = &sums[static_cast<size_t>(row) * (size.x + 1u)];
        // The share of the edge's height, and its mean distance to the right side,
        // sample by sample.
        const double width = double(size.x);
        const auto put = [&](double a, double b, double part) { // within one sample
            const double middle = 0.5 * (a + b);
            if (middle >= width)
                return;
            if (middle < 0.0) {
                out[0] += part;
                return;
            }
            const auto column = static_cast<size_t>(middle);
            const double right = double(column + 1) - middle;
            out[column] += part * right;
            out[column + 1] += part * (1.0 - right);
        };
        if (x1 - x0 < 1e-12) {
            put(x0, x1, height);
            continue;
        }
        const double in_low = std::clamp(x0, 0.0, width), in_high = std::clamp(x1, 0.0, width);
        const double per = height / (x1 - x0);
        if (x0 < 0.0)
            out[0] += per * (std::min(x1, 0.0) - x0);
        for (double a = in_low; a < in_high;) {
            const double b = std::min(in_high, std::floor(a) + 1.0);
            put(a, b, per * (b - a));
            a = b;
        }
    }
}

double signed_area(const Outline& polygon) {
    double twice = 0;
    for (size_t i = 0; i < polygon.size(); ++i) {
        const glm::dvec2 a = polygon[i], b = polygon[(i + 1) % polygon.size()];
        twice += (a.x - polygon[0].x) * (b.y - polygon[0].y) -
                 (b.x - polygon[0].x) * (a.y - polygon[0].y);
    }
    return 0.5 * twice;
}

// A polygon with what tells whether others lie within it.
struct Nested {
    const Outline* outline;
    double area;
    glm::dvec2 low, high;           // of its box
    std::vector<Nested*> smaller{}; // those whose boxes meet its box, to be compared with it
    size_t waiting = 0;             // corners of these
    size_t depth = 0;               // how many it lies within
};

// Makes those deeper that lie within a polygon: most of the middles of their edges do, as a corner
// may lie on the other's edge. Each middle has the answer of contains(), from the edges at its
// height alone.
void deepen_within(Nested& outer) {
    struct Middle {
        glm::dvec2 at;
        Nested* of;
        bool is_in = false;
    };
    std::vector<Middle> middles;
    for (Nested* const one : outer.smaller)
        for (size_t i = 0; i < one->outline->size(); ++i) {
            const Outline& edges = *one->outline;
            middles.push_back({0.5 * (edges[i] + edges[(i + 1) % edges.size()]), one});
        }
    std::sort(middles.begin(), middles.end(),
              [](const Middle& a, const Middle& b) { return a.at.y < b.at.y; });
    for (size_t i = 0; i < outer.outline->size(); ++i) {
        const glm::dvec2 a = (*outer.outline)[i];
        const glm::dvec2 b = (*outer.outline)[(i + 1) % outer.outline->size()];
        const double end = std::max(a.y, b.y);
        for (auto middle =
                 std::lower_bound(middles.begin(), middles.end(), std::min(a.y, b.y),
                                  [](const Middle&one, double y) { return one.at.y < y; });
             middle != middles.end() && middle->at.y < end; ++middle)
            if (middle->at.x < a.x + (middle->at.y - a.y) / (b.y - a.y) * (b.x - a.x))
                middle->is_in = !middle->is_in;
    }
    std::map<Nested*, size_t> within;
    for (const Middle& middle : middles)
        within[middle.of] += middle.is_in ? 1 : 0;
    for (const auto& [one, count] : within)
        if (2 * count > one->outline->size())
            ++one->depth;
    outer.smaller.clear();
    outer.waiting = 0;
}

// Compared at once are as many corners as the outer one has, so that its own edges cost no more
// than theirs, and lists of contours within contours do not grow with the square of their number.
void add_smaller(Nested& outer, Nested& one) {
    constexpr size_t kFewest = 256;
    outer.smaller.push_back(&one);
    outer.waiting += one.outline->size();
    if (outer.waiting >= std::max(kFewest, outer.outline->size()))
        deepen_within(outer);
}

// Each polygon with its depth. Only those whose boxes meet are compared, which a walk from the left
// to the right finds.
std::vector<Nested> nested(std::span<const Outline> polygons) {
    std::vector<Nested> all;
    for (const Outline& polygon : polygons) {
        if (polygon.empty())
            continue;
        Nested one{&polygon, signed_area(polygon), polygon[0], polygon[0]};
        for (const glm::dvec2 at : polygon) {
            one.low = glm::min(one.low, at);
            one.high = glm::max(one.high, at);
        }
        all.push_back(std::move(one));
    }
    std::vector<Nested*> from_left, open;
    for (Nested& one : all)
        from_left.push_back(&one);
    std::sort(from_left.begin(), from_left.end(),
              [](const Nested* a, const Nested* b) { return a->low.x < b->low.x; });
    for (Nested* const one : from_left) {
        std::erase_if(open, [&](const Nested* other) { return other->high.x < one->low.x; });
        for (Nested* const other : open) {
            if (other->low.y > one->high.y || other->high.y < one->low.y)
                continue;
            if (std::abs(other->area) > std::abs(one->area))
                add_smaller(*other, *one);
            else if (std::abs(one->area) > std::abs(other->area))
                add_smaller(*one, *other);
        }
        open.push_back(one);
    }
    for (Nested& one : all)
        if (!one.smaller.empty())
            deepen_within(one);
    return all;
}

} // namespace

std::vector<Outline> outlines_of(std::span<const uint16_t> slice, glm::uvec2 size, uint16_t label) {
    const Mask mask = mask_of(slice, size, label);
    if (mask.set.empty())
        return {};
    Tracer tracer(mask);
    tracer.trace();
    tracer.join_holes();
    return tracer.outlines();
}

std::vector<float> covered_areas(std::span<const Outline> polygons, glm::uvec2 size) {
    std::vector<double> sums((size_t{size.x} + 1) * size.y);
    for (const Nested& one : nested(polygons)) {
        const Outline& polygon = *one.outline;
        // To the right of an edge that rises in y lies what a polygon of negative
        // area encloses.
        const bool turned = (one.area > 0) != (one.depth % 2 == 1);
        for (size_t i = 0; i < polygon.size(); ++i) {
            glm::dvec2 a = polygon[i] + 0.5, b = polygon[(i + 1) % polygon.size()] + 0.5;
            if (turned)
                std::swap(a, b);
            add_edge(a, b, size, sums);
        }
    }
    std::vector<float> covered;
    covered.reserve(size_t{size.x} * size.y);
    for (uint32_t y = 0; y < size.y; ++y) {
        double sum = 0;
        for (uint32_t x = 0; x < size.x; ++x) {
            sum += sums[size_t{y} * (size.x + 1u) + x];
            covered.push_back(static_cast<float>(std::clamp(sum, 0.0, 1.0)));
        }
    }
    return covered;
}

} // namespace palpate::io
