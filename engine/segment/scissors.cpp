#include "engine/segment/scissors.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/json_value.h"
#include "engine/base/polygon.h"
#include "engine/segment/bit_mask.h"
#include "engine/segment/label_samples.h"

namespace palpate {

namespace {

constexpr double kEndless = std::numeric_limits<double>::infinity();

struct Rect {
    glm::dvec2 low{kEndless}, high{-kEndless};

    void take(glm::dvec2 at) {
        low = glm::min(low, at);
        high = glm::max(high, at);
    }
    bool meets(const Rect& other) const {
        return glm::all(glm::lessThanEqual(low, other.high)) &&
               glm::all(glm::lessThanEqual(other.low, high));
    }
};

// The outline as it is seen, with its edges in bands, so that a place is compared with the few
// edges of its own.
class Stencil {
 public:
    Stencil(const Scissors& scissors, const Task& task)
        : towards_(glm::normalize(scissors.towards)), eye_mm_(scissors.eye_mm) {
        const glm::dvec3 away = glm::abs(towards_);
        glm::dvec3 axis(0.0);
        axis[away.x <= away.y && away.x <= away.z ? 0 : away.y <= away.z ? 1 : 2] = 1.0;
        across_ = glm::normalize(glm::cross(towards_, axis));
        down_ = glm::cross(towards_, across_);
        for (const glm::dvec3 corner : scissors.outline_mm) {
            corners_.push_back(seen_at(corner).value_or(glm::dvec2(NAN)));
            rect_.take(corners_.back());
        }
        const size_t count = corners_.size();
        bands_.resize(std::clamp<size_t>(std::min(count, kMostEntries / count), 1, kMostBands));
        per_band_ = (rect_.high.y - rect_.low.y) / double(bands_.size());
        for (size_t i = 0; i < count && !task.stop.stop_requested(); ++i) {
            const glm::dvec2 a = corner(i), b = corner(i + 1);
            for (size_t at = band(std::min(a.y, b.y)); at <= band(std::max(a.y, b.y)); ++at)
                bands_[at].push_back(static_cast<uint32_t>(i));
        }
    }

    // The place of a point in the picture; none where the eye does not see it.
    std::optional<glm::dvec2> seen_at(glm::dvec3 point_mm) const {
        const glm::dvec3 from = eye_mm_ ? point_mm - *eye_mm_ : point_mm;
        const glm::dvec2 at(glm::dot(across_, from), glm::dot(down_, from));
        if (!eye_mm_)
            return at;
        const double ahead_mm = glm::dot(towards_, from);
        return ahead_mm > 0.0 ? std::optional(at / ahead_mm) : std::nullopt;
    }

    bool holds(glm::dvec3 point_mm) const {
        const std::optional<glm::dvec2> at = seen_at(point_mm);
        if (!at || !(at->y >= rect_.low.y && at->y <= rect_.high.y))
            return false;
        bool inside = false;
        for (const uint32_t edge : bands_[band(at->y)])
            inside ^= crosses(corner(edge), corner(edge + 1), *at);
        return inside;
    }

    // Whether all of a convex body that has these corners lies within, or none of it; nothing where
    // it may be divided.
    std::optional<bool> holds_all(std::span<const glm::dvec3> body_mm) const {
        Rect body;
        for (const glm::dvec3 point : body_mm) {
            const std::optional<glm::dvec2> at = seen_at(point);
            if (!at)
                return std::nullopt;
            body.take(*at);
        }
        // Samples within are rounded otherwise than the corners.
        const glm::dvec2 room = kRounding * (glm::abs(body.low) + glm::abs(body.high));
        body.low -= room;
        body.high += room;
        if (!body.meets(rect_))
            return false;
        for (size_t i = 0; i < corners_.size(); ++i) {
            Rect edge;
            edge.take(corner(i));
            edge.take(corner(i + 1));
            if (body.meets(edge))
                return std::nullopt;
        }
        return holds(body_mm[0]);
    }

    // Towards the eye, from a point.
    glm::dvec3 back(glm::dvec3 point_mm) const { return eye_mm_ ? *eye_mm_ - point_mm : -towards_; }
    double depth_mm(glm::dvec3 point_mm, glm::dvec3 from_mm) const {
        return glm::dot(towards_, point_mm - from_mm);
    }

 private:
    static constexpr size_t kMostBands = 1024;
    // An edge may lie in every band. So many entries take 64 MB, and twice that while they grow.
    static constexpr size_t kMostEntries = size_t{1} << 24;
    static constexpr double kRounding = 1e-9;

    glm::dvec2 corner(size_t i) const { return corners_[i % corners_.size()]; }
    size_t band(double y) const {
        const double at = (y - rect_.low.y) / per_band_;
        return at > 0.0 ? std::min(static_cast<size_t>(at), bands_.size() - 1) : 0;
    }

    glm::dvec3 towards_, across_{}, down_{};
    std::optional<glm::dvec3> eye_mm_;
    std::vector<glm::dvec2> corners_;
    Rect rect_;
    std::vector<std::vector<uint32_t>> bands_; // edges, by the corners at which they begin
    double per_band_ = 0.0;
};

// Samples that may be erased, and those that hide others: all that are not 0.
class Seen {
 public:
    Seen(BitMask mask, BitMask hiding, const Grid& grid, bool is_parallel)
        : mask_(std::move(mask)),
          hiding_(std::move(hiding)),
          index_from_mm_(index_from_world(grid)),
          most_(is_parallel ? kEndless : 1.0) {}

    // Whether a sample is seen first, on the way back to the eye.
    bool is_first(glm::uvec3 sample, glm::dvec3 back_mm) const {
        const glm::dvec3 by = index_from_mm_ * back_mm;
        glm::ivec3 at(sample);
        glm::dvec3 steps(0.0); // that were made along each axis
        for (bool has_left = false;;) {
            int axis = 0;
            double next = kEndless;
            for (int a = 0; a < 3; ++a)
                if (const double t = (steps[a] + 0.5) / std::abs(by[a]); t < next)
                    axis = a, next = t;
            if (!(next < most_))
                return true;
            at[axis] += by[axis] > 0.0 ? 1 : -1;
            steps[axis] += 1.0;
            if (at[axis] < 0 || at[axis] >= static_cast<int>(mask_.size()[axis]))
                return true;
            has_left = has_left || !mask_.has(glm::uvec3(at));
            if (has_left && hiding_.has(glm::uvec3(at)))
                return false;
        }
    }

 private:
    BitMask mask_, hiding_;
    glm::dmat3 index_from_mm_;
    double most_; // of the way, in units of back_mm
};

Result<void> check_scissors(const Volume& labels, const Scissors& s,
                            std::span<const uint16_t> locked) {
    PALPATE_TRY(check_labels(labels, "scissors"));
    const bool fills = s.action == ScissorsAction::fill_inside;
    if (fills || !s.all_labels) {
        if (s.label == 0)
            return fail("scissors: expected a label 1 .. 65535, found 0, the background");
        if (std::find(locked.begin(), locked.end(), s.label) != locked.end())
            return fail("scissors: expected a label that is not locked, found {}", s.label);
    }
    if (fills && s.seen_first)
        return fail(
            "scissors: expected a fill of all depths, or between two; found what is seen "
            "first");
    if (s.outline_mm.size() < 3)
        return fail("scissors: expected an outline of at least 3 corners, found {}",
                    s.outline_mm.size());
    const double length = glm::length(s.towards);
    if (!(length > 0.0 && std::isfinite(length)))
        return fail("scissors: expected a direction other than 0, found [{:g}, {:g}, {:g}]",
                    s.towards.x, s.towards.y, s.towards.z);
    if (s.depths_mm && !(s.depths_mm->first <= s.depths_mm->second))
        return fail("scissors: expected depths that rise, found {:g} to {:g} mm",
                    s.depths_mm->first, s.depths_mm->second);
    for (const glm::dvec3 corner : s.outline_mm) {
        if (!std::isfinite(corner.x + corner.y + corner.z))
            return fail("scissors: expected finite corners, found [{:g}, {:g}, {:g}]", corner.x,
                        corner.y, corner.z);
        if (s.eye_mm && !(glm::dot(s.towards, corner - *s.eye_mm) > 0.0))
            return fail("scissors: expected corners in front of the eye, found [{:g}, {:g}, {:g}]",
                        corner.x, corner.y, corner.z);
    }
    return {};
}

// A cut at work: by bricks, in any order.
class Cut {
 public:
    Cut(const Volume& labels, const Scissors& scissors, std::span<const uint16_t> locked,
        const Task& task)
        : labels_(labels),
          scissors_(scissors),
          task_(task),
          stencil_(scissors, task),
          is_locked_(65536) {
        for (const uint16_t label : locked)
            is_locked_[label] = label != 0;
        const bool holds = visit_scalar(labels.type(), [&]<class T>(T) {
            return double(scissors.label) <= double(std::numeric_limits<T>::max());
        });
        type_ = holds || !fills() ? labels.type() : ScalarType::u16;
    }

    ScalarType type() const { return type_; }

    // False: it was stopped.
    bool look(const Task& task) {
        BitMask mask(labels_.size()), hiding(labels_.size());
        const glm::uvec3 size = labels_.size();
        const bool done = run_all(size.z, task, [&](size_t z) {
            std::vector<uint16_t> row(size.x);
            for (uint32_t y = 0; y < size.y; ++y) {
                read_labels(labels_, glm::ivec3(0, y, z), glm::ivec3(size.x, 1, 1), row.data());
                uint64_t *const bits = mask.row(y, z), *const hides = hiding.row(y, z);
                for (uint32_t x = 0; x < size.x; ++x) {
                    bits[x / 64] |= uint64_t{changes(row[x])} << x % 64;
                    hides[x / 64] |= uint64_t{row[x] != 0} << x % 64;
                }
            }
        });
        if (done)
            seen_.emplace(std::move(mask), std::move(hiding), labels_.grid(), !scissors_.eye_mm);
        return done;
    }

    BrickPtr brick(glm::uvec3 position) const {
        const glm::ivec3 first(position * kBrickSide);
        const glm::uvec3 valid = labels_.valid_in_brick(position);
        std::vector<uint16_t> before(kBrickSamples);
        read_labels(labels_, first, glm::ivec3(kBrickSide), before.data());
        std::vector<uint16_t> after = before;
        if (std::any_of(before.begin(), before.end(), [&](uint16_t l) { return changes(l); }))
            cut(first, valid, after);
        if (after == before && type_ == labels_.type() && type_ != ScalarType::f32)
            return labels_.brick_ptr(position);
        return visit_scalar(type_, [&]<class T>(T) -> BrickPtr {
            const std::vector<T> typed(after.begin(), after.end());
            return Brick::make(std::span<const T>(typed), valid);
        });
    }

 private:
    bool fills() const { return scissors_.action == ScissorsAction::fill_inside; }
    bool changes(uint16_t label) const { // samples of it may
        if (is_locked_[label])
            return false;
        if (fills())
            return scissors_.all_labels ? label != scissors_.label : label == 0;
        return scissors_.all_labels ? label != 0 : label == scissors_.label;
    }

    void cut(glm::ivec3 first, glm::uvec3 valid, std::vector<uint16_t>& samples) const {
        std::vector<glm::dvec3> corners;
        for (uint32_t corner = 0; corner < 8; ++corner)
            corners.push_back(world_point(
                labels_.grid(),
                glm::dvec3(first) +
                    glm::dvec3(valid - 1u) * glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2)));
        const std::optional<bool> all = stencil_.holds_all(corners);
        const bool wanted = scissors_.action != ScissorsAction::erase_outside;
        if (all && *all != wanted)
            return;
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y && !task_.stop.stop_requested(); ++y)
                for (uint32_t x = 0; x < valid.x; ++x) {
                    uint16_t& sample = samples[offset_in_brick({x, y, z})];
                    if (!changes(sample))
                        continue;
                    const glm::ivec3 at = first + glm::ivec3(x, y, z);
                    const glm::dvec3 point_mm = world_point(labels_.grid(), glm::dvec3(at));
                    if ((all || stencil_.holds(point_mm) == wanted) && is_deep_enough(point_mm) &&
                        (!seen_ || seen_->is_first(glm::uvec3(at), stencil_.back(point_mm))))
                        sample = fills() ? scissors_.label : uint16_t{0};
                }
    }
    bool is_deep_enough(glm::dvec3 point_mm) const {
        if (!scissors_.depths_mm)
            return true;
        const double depth = stencil_.depth_mm(point_mm, scissors_.outline_mm.front());
        return depth >= scissors_.depths_mm->first && depth <= scissors_.depths_mm->second;
    }

    const Volume& labels_;
    const Scissors& scissors_;
    const Task& task_;
    Stencil stencil_;
    std::vector<bool> is_locked_;
    ScalarType type_{};
    std::optional<Seen> seen_;
};

} // namespace

Result<Volume> cut_labels(const Volume& labels, const Scissors& scissors,
                          std::span<const uint16_t> locked, const Task& task) {
    PALPATE_TRY(check_scissors(labels, scissors, locked));
    Cut cut(labels, scissors, locked, task);
    if (scissors.seen_first && !cut.look(task.part(0.0, 0.1)))
        return stopped();
    Result<Volume> made =
        make_bricks(labels.grid(), cut.type(), task.part(scissors.seen_first ? 0.1 : 0.0, 1.0),
                    [&](glm::uvec3 position) { return cut.brick(position); });
    if (task.stop.stop_requested()) // a brick may be half done
        return stopped();
    return made;
}

Result<Scissors> parse_scissors(std::string_view text, const std::string& name) {
    constexpr double kFar_mm = 1e9;
    constexpr size_t kMostCorners = 1000000;
    PALPATE_TRY(const Json json, parse_json(text, name));
    JsonErrors errors{name, {}};
    const JsonValue in(json, "", errors);
    in.only_keys({"scissors", "units", "action", "label", "all_labels", "outline_mm", "towards",
                  "eye_mm", "depths_mm", "seen_first"});
    Scissors made;
    in.at("scissors").whole_number(1, 1);
    in.at("units").choice<int>({{"mm", 0}});
    made.action =
        in.at("action").choice<ScissorsAction>({{"erase-inside", ScissorsAction::erase_inside},
                                                {"erase-outside", ScissorsAction::erase_outside},
                                                {"fill-inside", ScissorsAction::fill_inside}});
    uint32_t label = made.label;
    in.take("label", label, 1, 65535);
    made.label = static_cast<uint16_t>(label);
    in.take("all_labels", made.all_labels);
    in.take("seen_first", made.seen_first);
    for (const JsonValue& corner : in.at("outline_mm").items(3, kMostCorners))
        made.outline_mm.push_back(corner.vector(-kFar_mm, kFar_mm));
    made.towards = in.at("towards").direction();
    if (const auto eye = in.find("eye_mm"))
        made.eye_mm = eye->vector(-kFar_mm, kFar_mm);
    if (const auto depths = in.find("depths_mm")) {
        const std::vector<JsonValue> ends = depths->items(2, 2);
        if (ends.size() == 2)
            made.depths_mm = {ends[0].number(-kFar_mm, kFar_mm), ends[1].number(-kFar_mm, kFar_mm)};
    }
    if (errors.first)
        return tl::unexpected(*errors.first);
    return made;
}

} // namespace palpate
