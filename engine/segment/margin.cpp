#include "engine/segment/margin.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/segment/bit_mask.h"
#include "engine/segment/brick_array.h"
#include "engine/segment/grid_change.h"
#include "engine/segment/label_bounds.h"
#include "engine/segment/label_samples.h"
#include "engine/segment/signed_distance.h"

namespace palpate {

namespace {

constexpr double kEver = std::numeric_limits<double>::infinity();

// How a label changes, by the distance to its border: its samples stay from .. to away from it, the
// first excluded; samples outside join up to `gain` away.
struct WallChange {
    double from_mm = 0.0, to_mm = kEver, gain_mm = 0.0;

    double reach_mm() const {
        return std::max({from_mm, gain_mm, to_mm < kEver ? to_mm : 0.0}) * kOnTheBall;
    }
    bool stays(double inside_mm) const {
        return inside_mm > from_mm * kOnTheBall && inside_mm <= to_mm * kOnTheBall;
    }
    bool joins(double outside_mm) const { return outside_mm <= gain_mm * kOnTheBall; }
};

class WallChanger {
 public:
    WallChanger(const Volume& labels, const WallChange& change, const ChangedLabels& which)
        : labels_(labels),
          change_(change),
          which_(which),
          locked_(65536),
          made_(labels.size()),
          nearest_mm_(labels.size(), std::numeric_limits<float>::infinity()) {
        for (const uint16_t label : which.locked)
            locked_[label] = label != 0;
    }

    Result<Volume> run(const Task& task) {
        const auto bounds = label_bounds(labels_, task.part(0.0, 0.1));
        if (!bounds)
            return stopped();
        std::vector<std::pair<uint16_t, IndexBox>> changing;
        for (const auto& one : *bounds)
            if (which_.label ? one.first == *which_.label : !locked_[one.first])
                changing.push_back(one);
        double whole = 0.0, done = 0.0; // of the work, which goes with the boxes
        const auto work = [](const IndexBox& box) {
            const glm::dvec3 size(box.high - box.low + 1);
            return size.x * size.y * size.z;
        };
        for (const auto& [label, box] : changing)
            whole += work(box);
        for (const auto& [label, box] : changing) {
            const double next = done + work(box);
            PALPATE_TRY(change_label(
                label, box, task.part(0.1 + 0.8 * done / whole, 0.1 + 0.8 * next / whole)));
            done = next;
        }
        return make_bricks(labels_.grid(), labels_.type(), task.part(0.9, 1.0),
                           [&](glm::uvec3 position) { return brick(position); });
    }

 private:
    Result<void> change_label(uint16_t label, const IndexBox& bounds, const Task& task) {
        // A sample more than the margin: what is nearest outside the label lies within too.
        const glm::ivec3 more(
            glm::ceil(change_.reach_mm() / spacing_mm(labels_.grid()) + glm::dvec3(1.0)));
        const IndexBox box{glm::max(bounds.low - more, glm::ivec3(0)),
                           glm::min(bounds.high + more, glm::ivec3(labels_.size()) - 1)};
        PALPATE_TRY(const BrickMaker cut, crop_bricks(labels_, box.low, box.high));
        PALPATE_TRY(const Volume part, make_bricks(cut, task.part(0.0, 0.1)));
        // Farther than the limit is beyond reach: the value there need not be exact.
        PALPATE_TRY(
            const Volume away,
            signed_distance(
                part, {.of = DistanceOf::label, .label = label, .max_mm = 2.0 * change_.reach_mm()},
                task.part(0.1, 0.9)));
        const glm::ivec3 low = box.low / int(kBrickSide),
                         count = box.high / int(kBrickSide) - low + 1;
        const auto in_brick = [&](size_t n) {
            const glm::ivec3 at(int(n) % count.x, int(n) / count.x % count.y,
                                int(n) / (count.x * count.y));
            change_brick(label, box, away, low + at);
        };
        if (!run_all(size_t(count.x) * size_t(count.y) * size_t(count.z), task.part(0.9, 1.0),
                     in_brick))
            return stopped();
        return {};
    }

    // Whether a label may take a sample of the map.
    bool may_take(uint16_t from) const {
        return from == 0 || (which_.overwrite && which_.label && !locked_[from]);
    }

    void change_brick(uint16_t label, const IndexBox& box, const Volume& away, glm::ivec3 at) {
        const glm::ivec3 first = at * int(kBrickSide), low = glm::max(first, box.low),
                         high = glm::min(first + int(kBrickSide) - 1, box.high);
        const glm::ivec3 size = high - low + 1;
        std::vector<float> mm(size_t(size.x) * size_t(size.y) * size_t(size.z));
        std::vector<uint16_t> before(mm.size());
        read_box(away, low - box.low, size, packed(glm::uvec3(size)), mm.data());
        read_labels(labels_, low, size, before.data());
        size_t i = 0;
        for (int z = low.z; z <= high.z; ++z)
            for (int y = low.y; y <= high.y; ++y)
                for (int x = low.x; x <= high.x; ++x, ++i) {
                    const bool own = before[i] == label;
                    const bool changes = own ? !change_.stays(-double{mm[i]})
                                             : change_.joins(mm[i]) && may_take(before[i]);
                    if (!changes)
                        continue;
                    const uint32_t to = offset_in_brick(glm::uvec3(glm::ivec3(x, y, z) - first));
                    float& nearest = nearest_mm_.write(glm::uvec3(at))[to];
                    if (!own && mm[i] >= nearest)
                        continue;
                    nearest = mm[i];
                    made_.write(glm::uvec3(at))[to] = own ? kGone : label;
                }
    }

    BrickPtr brick(glm::uvec3 position) const {
        const int32_t* made = made_.find(position);
        if (!made && labels_.type() != ScalarType::f32) // where NaN becomes 0
            return labels_.brick_ptr(position);
        std::vector<uint16_t> before(kBrickSamples);
        read_labels(labels_, glm::ivec3(position * kBrickSide), glm::ivec3(kBrickSide),
                    before.data());
        return visit_scalar(labels_.type(), [&]<class T>(T) -> BrickPtr {
            std::vector<T> samples(before.begin(), before.end());
            for (uint32_t i = 0; made && i < kBrickSamples; ++i)
                if (made[i] != 0)
                    samples[i] = made[i] == kGone ? T(0) : T(made[i]);
            return Brick::make(std::span<const T>(samples), labels_.valid_in_brick(position));
        });
    }

    static constexpr int32_t kGone = -1;

    const Volume& labels_;
    const WallChange change_;
    const ChangedLabels& which_;
    std::vector<bool> locked_;
    BrickArray<int32_t> made_;     // the label that a sample gets, kGone; 0: it stays
    BrickArray<float> nearest_mm_; // of those that get a label
};

Result<Volume> with_change(const Volume& labels, const WallChange& change,
                           const ChangedLabels& which, const char* name, const Task& task) {
    PALPATE_TRY(check_labels(labels, name));
    PALPATE_TRY(check_perpendicular(labels.grid(), name));
    if (which.label == uint16_t{0})
        return fail("{}: expected a label 1 .. 65535, found 0, which is the background", name);
    if (which.label &&
        std::find(which.locked.begin(), which.locked.end(), *which.label) != which.locked.end())
        return fail("{}: expected a label that is not locked, found {}", name, *which.label);
    return WallChanger(labels, change, which).run(task);
}

} // namespace

Result<Volume> margin(const Volume& labels, double by_mm, const ChangedLabels& which,
                      const Task& task) {
    if (by_mm == 0.0 || !std::isfinite(by_mm))
        return fail("margin: expected mm above or below 0, found {:g}", by_mm);
    return with_change(labels,
                       by_mm > 0.0 ? WallChange{.gain_mm = by_mm} : WallChange{.from_mm = -by_mm},
                       which, "margin", task);
}

Result<Volume> hollow(const Volume& labels, double thickness_mm, Wall wall,
                      const ChangedLabels& which, const Task& task) {
    if (!(thickness_mm > 0.0) || !std::isfinite(thickness_mm))
        return fail("hollow: expected a thickness above 0 mm, found {:g}", thickness_mm);
    const double half = 0.5 * thickness_mm;
    const WallChange change = wall == Wall::inside ? WallChange{.to_mm = thickness_mm}
                              : wall == Wall::middle
                                  ? WallChange{.to_mm = half, .gain_mm = half}
                                  : WallChange{.to_mm = 0.0, .gain_mm = thickness_mm};
    // A label would vanish where the wall does not reach from one sample to the next.
    const glm::dvec3 spacing = spacing_mm(labels.grid());
    const double least = std::min({spacing.x, spacing.y, spacing.z});
    if (change.reach_mm() < least)
        return fail("hollow: expected a thickness of at least {:g} mm on this grid, found {:g}",
                    least * thickness_mm / change.reach_mm() * kOnTheBall, thickness_mm);
    return with_change(labels, change, which, "hollow", task);
}

} // namespace palpate
