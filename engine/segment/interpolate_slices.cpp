#include "engine/segment/interpolate_slices.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <vector>

#include "engine/segment/label_bounds.h"
#include "engine/segment/label_samples.h"
#include "engine/segment/rows.h"
#include "engine/segment/signed_distance.h"
#include "engine/segment/slice_pieces.h"

namespace palpate {

namespace {

constexpr double kMoveSteps = 64.0; // of a sample

// The slices of a grid across an axis, and the two axes in them.
struct Slicing {
    int axis, u, v;
    glm::ivec2 size;
    glm::dvec2 spacing_mm;

    Slicing(const Grid& grid, int across)
        : axis(across),
          u(across == 0 ? 1 : 0),
          v(across == 2 ? 1 : 2),
          size(grid.size[u], grid.size[v]),
          spacing_mm(palpate::spacing_mm(grid)[u], palpate::spacing_mm(grid)[v]) {}
    glm::ivec3 index(glm::ivec2 at, int slice) const {
        glm::ivec3 out(slice);
        out[u] = at.x;
        out[v] = at.y;
        return out;
    }
};

// Samples low .. high of a slice, both included.
struct SliceBox {
    glm::ivec2 low, high;

    glm::ivec2 size() const { return high - low + 1; }
    size_t count() const { return size_t(size().x) * size_t(size().y); }
    size_t place(glm::ivec2 at) const {
        return size_t(at.x - low.x) + size_t(size().x) * size_t(at.y - low.y);
    }
    SliceBox with(glm::dvec2 point) const {
        return {glm::min(low, glm::ivec2(glm::floor(point))),
                glm::max(high, glm::ivec2(glm::ceil(point)))};
    }
    SliceBox moved_too(glm::dvec2 by) const { // this and this moved
        return with(glm::dvec2(low) + by).with(glm::dvec2(high) + by);
    }
    SliceBox grown(int by, glm::ivec2 slice) const {
        return {glm::max(low - by, glm::ivec2(0)), glm::min(high + by, slice - 1)};
    }
};

// The signed distance within a slice to the samples of a set, known in a box.
struct SliceField {
    SliceBox box;
    std::vector<float> mm;

    // Linear between samples; beyond the box, which is where the slice ends, the nearest value.
    double at(glm::dvec2 p) const {
        p = glm::clamp(p, glm::dvec2(box.low), glm::dvec2(box.high));
        const glm::ivec2 low = glm::min(glm::ivec2(glm::floor(p)), box.high),
                         high = glm::min(low + 1, box.high);
        const glm::dvec2 share = p - glm::dvec2(low);
        const auto row = [&](int y) {
            return (1.0 - share.x) * double{mm[box.place({low.x, y})]} +
                   share.x * double{mm[box.place({high.x, y})]};
        };
        return (1.0 - share.y) * row(low.y) + share.y * row(high.y);
    }
};

// A set of samples of a slice: those of some pieces.
struct PieceSet {
    const SlicePieces& pieces;
    glm::ivec2 low; // where the pieces' first sample lies in the slice
    std::vector<bool> has{};

    PieceSet(const SlicePieces& of, glm::ivec2 first, const std::vector<uint32_t>& numbers)
        : pieces(of), low(first), has(of.counts.size(), numbers.empty()) {
        for (const uint32_t number : numbers)
            has[number] = true;
        has[0] = false;
    }
    bool holds(glm::ivec2 at) const {
        const glm::ivec2 p = at - low;
        return glm::all(glm::greaterThanEqual(p, glm::ivec2(0))) &&
               glm::all(glm::lessThan(p, pieces.size)) &&
               has[pieces.numbers[size_t(p.x) + size_t(pieces.size.x) * size_t(p.y)]];
    }
    SliceBox box() const {
        SliceBox out{low + pieces.size, low - 1};
        for (size_t i = 0; i < pieces.numbers.size(); ++i)
            if (has[pieces.numbers[i]]) {
                const glm::ivec2 at =
                    low + glm::ivec2(int(i) % pieces.size.x, int(i) / pieces.size.x);
                out = {glm::min(out.low, at), glm::max(out.high, at)};
            }
        return out;
    }
};

// The labels that take the samples of a slice between, x fastest of the two axes left.
struct Between {
    std::vector<float> lowest; // of the blends that are negative
    std::vector<uint16_t> label;
};

// Slices a < b that carry a label, and none between them does.
struct Gap {
    int a, b;
};

class BetweenSlices {
 public:
    BetweenSlices(const Volume& labels, int axis)
        : labels_(labels),
          slicing_(labels.grid(), axis),
          samples_(size_t(slicing_.size.x) * size_t(slicing_.size.y)),
          between_(labels.size()[axis]) {}

    // Gaps of one label do not share slices.
    Result<void> fill(uint16_t label, const IndexBox& bounds, const std::vector<Gap>& gaps,
                      const Task& task) {
        const SliceBox box{{bounds.low[slicing_.u], bounds.low[slicing_.v]},
                           {bounds.high[slicing_.u], bounds.high[slicing_.v]}};
        std::mutex mutex;
        Result<void> all{};
        if (!run_all(gaps.size(), task, [&](size_t i) {
                if (Result<void> one = fill_gap(label, box, gaps[i], task); !one) {
                    const std::lock_guard lock(mutex);
                    all = std::move(one);
                }
            }))
            return stopped();
        return all;
    }

    Result<Volume> result(const Task& task) const {
        return visit_scalar(labels_.type(), [&]<class T>(T) {
            return make_rows<T>(labels_.grid(), task,
                                [&](uint32_t y, uint32_t z, std::span<T> row) { put(y, z, row); });
        });
    }

 private:
    SlicePieces pieces(uint16_t label, const SliceBox& box, int slice) const {
        glm::ivec3 size = slicing_.index(box.size(), 1);
        std::vector<uint16_t> samples(box.count());
        read_labels(labels_, slicing_.index(box.low, slice), size, samples.data());
        std::vector<uint8_t> own(samples.size());
        std::transform(samples.begin(), samples.end(), own.begin(),
                       [label](uint16_t one) { return uint8_t(one == label); });
        return pieces_of(own, box.size());
    }

    Result<SliceField> field(const PieceSet& set, const SliceBox& box, const Task& task) const {
        std::vector<uint8_t> samples(box.count());
        for (int y = box.low.y; y <= box.high.y; ++y)
            for (int x = box.low.x; x <= box.high.x; ++x)
                samples[box.place({x, y})] = set.holds({x, y});
        const Grid grid{glm::uvec3(slicing_.index(box.size(), 1)), labels_.grid().world_from_index};
        // The border is nowhere near in a slice full of the label.
        const double most = glm::length(glm::dvec2(slicing_.size) * slicing_.spacing_mm);
        PALPATE_TRY(const Volume away, signed_distance(make_volume<uint8_t>(grid, samples),
                                                       {.max_mm = most}, {task.stop, {}}));
        SliceField out{box, std::vector<float>(box.count())};
        read_box(away, glm::ivec3(0), glm::ivec3(grid.size), packed(grid.size), out.mm.data());
        return out;
    }

    Result<void> fill_gap(uint16_t label, const SliceBox& box, const Gap& gap, const Task& task) {
        const SlicePieces a = pieces(label, box, gap.a), b = pieces(label, box, gap.b);
        for (const PieceGroup& group : matched_pieces(a, b, slicing_.spacing_mm)) {
            const PieceSet in_a(a, box.low, group.in_a), in_b(b, box.low, group.in_b);
            const bool alone = group.in_a.empty() || group.in_b.empty();
            const glm::dvec2 way =
                alone ? glm::dvec2(0.0)
                      : glm::round((centroid_of(b, group.in_b) - centroid_of(a, group.in_a)) *
                                   kMoveSteps) /
                            kMoveSteps;
            SliceBox reach = (group.in_a.empty() ? in_b : in_a).box();
            if (!alone) {
                const SliceBox other = in_b.box();
                reach = reach.moved_too(way);
                reach = reach.with(glm::dvec2(other.low)).with(glm::dvec2(other.high));
                const SliceBox back = other.moved_too(-way);
                reach = reach.with(glm::dvec2(back.low)).with(glm::dvec2(back.high));
            }
            reach = reach.grown(0, slicing_.size);
            // Distances are exact where both sets lie in the box, with a sample around them.
            const SliceBox all = reach.with(glm::dvec2(box.low)).with(glm::dvec2(box.high));
            const SliceBox known =
                (alone ? all : reach).grown(int(std::ceil(glm::length(way))) + 2, slicing_.size);
            PALPATE_TRY(const SliceField mm_a, field(in_a, known, task));
            PALPATE_TRY(const SliceField mm_b, field(in_b, known, task));
            const PieceSet* only = !alone ? nullptr : group.in_a.empty() ? &in_b : &in_a;
            if (!run_all(size_t(gap.b - gap.a - 1), {task.stop, {}}, [&](size_t i) {
                    const int k = gap.a + 1 + int(i);
                    blend(between_[size_t(k)], label, reach, only, mm_a, mm_b, way,
                          double(k - gap.a) / double(gap.b - gap.a));
                }))
                return stopped();
        }
        return {};
    }

    void blend(Between& to, uint16_t label, const SliceBox& reach, const PieceSet* only,
               const SliceField& a, const SliceField& b, glm::dvec2 way, double share) const {
        to.lowest.resize(samples_, 0.0f);
        to.label.resize(samples_, 0);
        for (int y = reach.low.y; y <= reach.high.y; ++y)
            for (int x = reach.low.x; x <= reach.high.x; ++x) {
                if (only && !only->holds({x, y}))
                    continue;
                const glm::dvec2 p(x, y);
                const auto blended = float((1.0 - share) * a.at(p - share * way) +
                                           share * b.at(p + (1.0 - share) * way));
                const size_t i = size_t(x) + size_t(slicing_.size.x) * size_t(y);
                if (blended < to.lowest[i]) {
                    to.lowest[i] = blended;
                    to.label[i] = label;
                }
            }
    }

    template <class T>
    void put(uint32_t y, uint32_t z, std::span<T> row) const {
        std::vector<uint16_t> own(row.size());
        read_labels(labels_, {0, y, z}, {int(row.size()), 1, 1}, own.data());
        for (uint32_t x = 0; x < row.size(); ++x) {
            const glm::uvec3 at(x, y, z);
            const Between& from = between_[at[slicing_.axis]];
            row[x] = T(own[x]);
            if (own[x] == 0 && !from.label.empty())
                row[x] = T(from.label[at[slicing_.u] + size_t(slicing_.size.x) * at[slicing_.v]]);
        }
    }

    const Volume& labels_;
    const Slicing slicing_;
    const size_t samples_;         // of a slice
    std::vector<Between> between_; // by slice
};

// Which layers of samples across each axis carry a label.
using Layers = std::array<std::vector<bool>, 3>;

std::map<uint16_t, Layers> layers_of(const Volume& labels) {
    const glm::uvec3 size = labels.size();
    std::map<uint16_t, Layers> all;
    std::vector<uint16_t> row(size.x);
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y) {
            read_labels(labels, {0, y, z}, {int(size.x), 1, 1}, row.data());
            Layers* layers = nullptr;
            for (uint32_t x = 0; x < size.x; ++x) {
                if (row[x] == 0)
                    continue;
                if (!layers || row[x] != row[x - 1]) {
                    layers = &all[row[x]];
                    for (int axis = 0; axis < 3; ++axis)
                        (*layers)[size_t(axis)].resize(size[axis]);
                    (*layers)[1][y] = (*layers)[2][z] = true;
                }
                (*layers)[0][x] = true;
            }
        }
    return all;
}

std::vector<Gap> gaps_of(const std::vector<bool>& layers) {
    std::vector<Gap> gaps;
    int last = -1;
    for (int k = 0; k < int(layers.size()); ++k)
        if (layers[size_t(k)]) {
            if (last >= 0 && k > last + 1)
                gaps.push_back({last, k});
            last = k;
        }
    return gaps;
}

int axis_with_most(const Layers& layers) {
    int best = -1, most = 0;
    for (int axis = 0; axis < 3; ++axis) {
        int lacking = 0;
        for (const Gap& gap : gaps_of(layers[size_t(axis)]))
            lacking += gap.b - gap.a - 1;
        if (lacking > 0 && lacking >= most) {
            most = lacking;
            best = axis;
        }
    }
    return best;
}

} // namespace

Result<Volume> interpolate_slices(const Volume& labels, const BetweenSlicesOptions& options,
                                  const Task& task) {
    PALPATE_TRY(check_labels(labels, "interpolation between slices"));
    if (options.axis && (*options.axis < 0 || *options.axis > 2))
        return fail("interpolation between slices: expected an axis 0, 1 or 2, found {}",
                    *options.axis);
    if (options.label == uint16_t{0})
        return fail("interpolation between slices: expected a label 1 .. 65535, found 0");
    const auto bounds = label_bounds(labels, task.part(0.0, 0.1));
    if (!bounds)
        return stopped();
    std::map<uint16_t, Layers> layers = layers_of(labels);
    std::erase_if(layers, [&](const auto& one) {
        return (options.label && one.first != *options.label) ||
               std::find(options.locked.begin(), options.locked.end(), one.first) !=
                   options.locked.end();
    });
    Volume made = labels;
    size_t done = 0;
    for (int axis = 0; axis < 3; ++axis) {
        BetweenSlices between(made, axis);
        bool any = labels.type() == ScalarType::f32 && axis == 0; // where NaN becomes 0
        for (const auto& [label, drawn] : layers) {
            if (axis != options.axis.value_or(axis_with_most(drawn)))
                continue;
            const std::vector<Gap> gaps = gaps_of(drawn[size_t(axis)]);
            any |= !gaps.empty();
            const double from = double(done) / double(layers.size());
            const double to = double(++done) / double(layers.size());
            PALPATE_TRY(between.fill(label, bounds->at(label), gaps,
                                     task.part(0.1 + 0.8 * from, 0.1 + 0.8 * to)));
        }
        if (any) {
            PALPATE_TRY(made, between.result({task.stop, {}}));
        }
    }
    return made;
}

int axis_with_gaps(const Volume& labels, uint16_t label) {
    const std::map<uint16_t, Layers> layers = layers_of(labels);
    const auto found = layers.find(label);
    return found == layers.end() ? -1 : axis_with_most(found->second);
}

} // namespace palpate
