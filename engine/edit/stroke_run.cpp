#include "engine/edit/stroke_run.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "engine/base/assert.h"
#include "engine/base/profile.h"
#include "engine/edit/label_box.h"
#include "engine/edit/near_samples.h"
#include "engine/edit/regions.h"
#include "engine/volume/nearest_stored.h"

namespace palpate {

namespace {

constexpr size_t kBricksPerSlice = 16, kDabsPerSlice = 16;

template <class T>
bool has_data(T value) {
    return value == value;
}

void note_met(uint16_t& lowest, uint16_t label) {
    if (label != 0 && (lowest == 0 || label < lowest))
        lowest = label;
}

struct Bounds { // of the samples of a mask, both ends included
    glm::ivec3 low{kBrickSide}, high{-1};
};

Bounds bounds_of(const SampleMask& mask) {
    Bounds bounds;
    uint32_t columns = 0;
    for (int z = 0; z < int(kBrickSide); ++z)
        for (int y = 0; y < int(kBrickSide); ++y)
            if (const uint32_t row = mask.row(uint32_t(y), uint32_t(z))) {
                columns |= row;
                bounds.low = glm::min(bounds.low, glm::ivec3(0, y, z));
                bounds.high = glm::max(bounds.high, glm::ivec3(0, y, z));
            }
    bounds.low.x = columns ? __builtin_ctz(columns) : 0;
    bounds.high.x = columns ? 31 - __builtin_clz(columns) : -1;
    return bounds;
}

// Takes out of a mask the samples whose value does not serve.
template <class Serves>
void keep_where(SampleMask& mask, const Brick& samples, Serves&& serves) {
    const Brick::Pinned pinned = samples.pin();
    for (uint32_t z = 0; z < kBrickSide; ++z)
        for (uint32_t y = 0; y < kBrickSide; ++y) {
            uint32_t& row = mask.row(y, z);
            uint32_t kept = 0;
            for_each_bit(row, [&](uint32_t x) {
                const double value = samples.value(pinned, offset_in_brick({x, y, z}));
                kept |= uint32_t{serves(value)} << x;
            });
            row = kept;
        }
}

struct Parts { // of a motion in `count` equal parts: first .. last, none if first > last
    double first, last;
};

// Those in whose middle a tool's tip, on its way from a to b, can be within reach_mm of a brick,
// and few others: a leap of the hand has more parts than anybody waits for, nearly all of them
// elsewhere. a, b: from the grid's origin.
Parts parts_near(const Grid& grid, glm::uvec3 brick, glm::dvec3 a, glm::dvec3 b, double reach_mm,
                 double count) {
    const glm::dmat3 mm_from_index(grid.world_from_index);
    const glm::dvec3 center =
        mm_from_index * (glm::dvec3(brick * kBrickSide) + 0.5 * (kBrickSide - 1.0));
    double corner = 0.0; // with the half sample that a tip marks around it
    for (const double x : {-0.5, 0.5})
        for (const double y : {-0.5, 0.5})
            corner = std::max(corner, glm::length(mm_from_index * glm::dvec3(x, y, 0.5)));
    // Millimetres of 1e8 are good to 1e-8 each; this is more than what the lines below lose.
    const double rounding = 1e-12 * (glm::length(a) + glm::length(b) + glm::length(center));
    const double near = (kBrickSide + 1.0) * corner + reach_mm + rounding;
    const glm::dvec3 way = b - a;
    const double way2 = glm::dot(way, way);
    if (!(way2 > 0.0))
        return {0.0, count - 1.0};
    const double nearest = glm::dot(center - a, way) / way2;
    const glm::dvec3 away = center - (a + nearest * way);
    const double half2 = (near * near - glm::dot(away, away)) / way2;
    if (half2 < 0.0)
        return {0.0, -1.0};
    const double half = std::sqrt(half2);
    return {std::max(0.0, std::floor((nearest - half) * count) - 1.0),
            std::min(count - 1.0, std::ceil((nearest + half) * count) + 1.0)};
}

} // namespace

struct StrokeRun::Touched {
    uint64_t key = 0;
    glm::uvec3 position{0}; // in bricks
    SampleMask seen;
    SampleMask held;            // of operations that keep to edges: not worked on yet
    SampleMask region;          // of operations by region: what of `seen` counts
    std::vector<double> dose;   // of mill: seconds
    std::vector<float> samples; // of smooth walls: the distance from T, in samples
    uint64_t newly_seen = 0;    // by the last search
    uint16_t met_spared = 0;    // by the last slice of work
    std::vector<std::shared_ptr<const Segment>> waiting;
};

Result<std::unique_ptr<StrokeRun>> StrokeRun::start(Volume before, Tool tool, Operation operation,
                                                    std::optional<Volume> guide) {
    PALPATE_TRY(check(operation, before, guide ? &*guide : nullptr));
    operation = settled(std::move(operation), before);
    return std::unique_ptr<StrokeRun>(
        new StrokeRun(std::move(before), std::move(tool), std::move(operation), std::move(guide)));
}

StrokeRun::StrokeRun(Volume before, Tool tool, Operation operation, std::optional<Volume> guide)
    : given_(before),
      before_(before),
      now_(std::move(before)),
      tool_(std::move(tool)),
      operation_(std::move(operation)),
      guide_(std::move(guide)),
      freedoms_(operation_.on_labels() || !operation_.spared.empty() ? 65536 : 0,
                operation_.on_labels() && operation_.over ? Freedom::none : Freedom::free) {
    if (operation_.on_labels() && operation_.over)
        for (const uint16_t label : *operation_.over)
            freedoms_[label] = Freedom::free;
    if (!operation_.area.is_everywhere())
        area_ = operation_.area.table();
    for (const uint16_t label : operation_.spared)
        if (freedoms_[label] == Freedom::free)
            freedoms_[label] = Freedom::spared;
}

StrokeRun::~StrokeRun() = default;

void StrokeRun::add(std::span<const StrokePose> poses) {
    PALPATE_ASSERT(!lifted_);
    for (const StrokePose& pose : poses) {
        const bool still = last_ && pose.tool.position_mm == last_->tool.position_mm &&
                           pose.tool.rotation == last_->tool.rotation;
        if (still && operation_.kind != OperationKind::mill) { // holds nothing new
            last_ = pose;
            continue;
        }
        // The first pose is a sweep of its own, so that a dab needs no second one.
        if (operation_.alike)
            add_dabs(last_ ? *last_ : pose, pose);
        else
            add_segment(last_ ? *last_ : pose, pose);
        last_ = pose;
    }
}

void StrokeRun::add_segment(const StrokePose& from, const StrokePose& to) {
    const auto segment = std::make_shared<const Segment>(Segment{
        from, to,
        Sweep(tool_, before_.grid(), from, to, operation_.smooth_walls() ? kWallReach : 0.0)});
    const BrickRange range = bricks_of(segment->sweep, before_.grid());
    for (int z = range.low.z; z <= range.high.z; ++z)
        for (int y = range.low.y; y <= range.high.y; ++y)
            for (int x = range.low.x; x <= range.high.x; ++x) {
                Touched& brick = touched({x, y, z});
                if (brick.waiting.empty())
                    waiting_.push_back(&brick);
                brick.waiting.push_back(segment);
            }
}

StrokeRun::Touched& StrokeRun::touched(glm::uvec3 at) {
    const glm::uvec3 count = before_.brick_count();
    const uint64_t key = at.x + count.x * (at.y + uint64_t{count.y} * at.z);
    std::unique_ptr<Touched>& brick = bricks_[key];
    if (!brick) {
        brick = std::make_unique<Touched>();
        brick->key = key;
        brick->position = at;
    }
    return *brick;
}

void StrokeRun::add_dabs(const StrokePose& from, const StrokePose& to) {
    if (!last_)
        alike_ = alike_around(*guide_, from.tool.position_mm, *operation_.alike);
    if (!alike_)
        return;
    for (const StrokePose& pose : dabs_between(tool_, guide_->grid(), from, to))
        dabs_.push_back(pose);
}

// Looks at the tool at some poses; in which order they are found changes nothing.
void StrokeRun::flood_dabs(const std::stop_token& stop) {
    const size_t n = std::min(kDabsPerSlice, dabs_.size());
    std::vector<std::vector<BrickSamplesHeld>> held(n);
    tbb::parallel_for(size_t{0}, n, [&](size_t i) {
        held[i] = alike_and_connected(*guide_, tool_, dabs_[i], *alike_, stop);
    });
    dabs_.erase(dabs_.begin(), dabs_.begin() + ptrdiff_t(n));
    for (const std::vector<BrickSamplesHeld>& dab : held)
        for (const BrickSamplesHeld& part : dab) {
            Touched& brick = touched(part.brick);
            if (brick.held.empty())
                waiting_.push_back(&brick);
            for (size_t i = 0; i < part.samples.rows.size(); ++i)
                brick.held.rows[i] |= part.samples.rows[i];
        }
}

bool StrokeRun::work(const std::function<bool()>& go_on, const std::stop_token& stop) {
    const profile::Scope scope("edit bricks");
    PALPATE_ASSERT(!stopped_);
    if (operation_.names_label() && operation_.label > 255 && before_.type() == ScalarType::u8)
        before_ = now_ = as_u16_labels(given_); // here, where samples that cannot be read are told
    while (!waiting_.empty() || !dabs_.empty()) {
        if (waiting_.empty())
            flood_dabs(stop);
        const size_t n = std::min(kBricksPerSlice, waiting_.size());
        const std::vector<Touched*> slice(waiting_.begin(), waiting_.begin() + ptrdiff_t(n));
        waiting_.erase(waiting_.begin(), waiting_.begin() + ptrdiff_t(n));
        work_on(slice, stop);
        stopped_ = stop.stop_requested();
        if (stopped_)
            return false;
        if ((!waiting_.empty() || !dabs_.empty()) && !go_on())
            return false;
    }
    if (!operation_.by_region() || !lifted_)
        return true;
    if (!regions_) {
        RegionSearch::Region region;
        for (const auto& [key, brick] : bricks_)
            if (!brick->region.empty())
                region[key] = &brick->region;
        regions_ = std::make_unique<RegionSearch>(before_, operation_, std::move(region));
    }
    if (!edit_)
        edit_.emplace(now_);
    const bool done = regions_->work(*edit_, [&] { return !stop.stop_requested() && go_on(); });
    note_met(met_spared_, regions_->met_spared());
    return done;
}

void StrokeRun::work_on(std::span<Touched* const> bricks, const std::stop_token& stop) {
    std::vector<SampleMask> fresh(bricks.size());
    tbb::parallel_for(size_t{0}, bricks.size(), [&](size_t i) {
        find_samples(*bricks[i], fresh[i], stop);
        bricks[i]->waiting.clear();
    });
    if (!edit_)
        edit_.emplace(now_);
    visit_scalar(before_.type(), [&](auto t) {
        using T = decltype(t);
        std::vector<std::span<T>> out(bricks.size());
        for (size_t i = 0; i < bricks.size(); ++i) {
            samples_seen_ += bricks[i]->newly_seen;
            if (!operation_.by_region() && !fresh[i].empty())
                out[i] = edit_->write_brick<T>(bricks[i]->position);
        }
        tbb::parallel_for(size_t{0}, bricks.size(), [&](size_t i) {
            if (!out[i].empty())
                change<T>(*bricks[i], fresh[i], out[i], stop);
        });
    });
    for (Touched* const brick : bricks)
        note_met(met_spared_, std::exchange(brick->met_spared, 0));
}

void StrokeRun::find_samples(Touched& brick, SampleMask& fresh, const std::stop_token& stop) const {
    const bool mill = operation_.kind == OperationKind::mill;
    for (const auto& segment : brick.waiting)
        if (mill)
            add_dose(brick, fresh, *segment, stop);
        else if (operation_.smooth_walls())
            add_near(brick, fresh, segment->sweep, stop);
        else
            add_samples(fresh, segment->sweep, before_.grid(), brick.position,
                        before_.valid_in_brick(brick.position), stop);
    if (operation_.alike)
        fresh = std::exchange(brick.held, {});
    SampleMask first_seen = fresh;
    first_seen.keep_new(brick.seen);
    if (!mill && !operation_.smooth_walls())
        fresh = first_seen;
    for (SampleMask* const mask : {&first_seen, &fresh}) {
        keep_values(*mask, brick.position);
        keep_area(*mask, brick.position);
    }
    keep_unspared(brick, first_seen);
    keep_unspared(brick, fresh);
    brick.newly_seen = first_seen.count();
    if (operation_.by_region())
        for (size_t i = 0; i < fresh.rows.size(); ++i)
            brick.region.rows[i] |= fresh.rows[i];
}

void StrokeRun::add_near(Touched& brick, SampleMask& fresh, const Sweep& sweep,
                         const std::stop_token& stop) const {
    for_each_near(sweep, before_.grid(), brick.position, before_.valid_in_brick(brick.position),
                  sweep.far_mm(), stop, [&](glm::uvec3 place, Sweep::Near near) {
                      if (brick.samples.empty())
                          brick.samples.assign(kBrickSamples, float{kWallReach});
                      float& nearest = brick.samples[offset_in_brick(place)];
                      const auto samples = static_cast<float>(near.samples());
                      if (samples < nearest) {
                          nearest = samples;
                          fresh.row(place.y, place.z) |= uint32_t{1} << place.x;
                      }
                  });
}

void StrokeRun::add_dose(Touched& brick, SampleMask& fresh, const Segment& segment,
                         const std::stop_token& stop) const {
    const double seconds = segment.to.time_s - segment.from.time_s;
    if (!(seconds > 0.0))
        return;
    const Grid& grid = before_.grid();
    const double half_sample = 8.0 * Sweep::tolerance_for(grid);
    const double reach = tool_.shape ? tool_.shape->bounds().reach_mm() : 0.0;
    const double parts =
        std::max(1.0, std::ceil(travel_mm(segment.from, segment.to, reach) / half_sample));
    const glm::dvec3 origin(grid.world_from_index[3]);
    const bool smooth = operation_.smooth_walls();
    const Parts near = parts_near(grid, brick.position, segment.from.tool.position_mm - origin,
                                  segment.to.tool.position_mm - origin,
                                  reach + (smooth ? segment.sweep.far_mm() : 0.0), parts);
    const glm::uvec3 valid = before_.valid_in_brick(brick.position);
    for (double part = near.first; part <= near.last && !stop.stop_requested(); ++part) {
        const StrokePose pose = pose_between(segment.from, segment.to, (part + 0.5) / parts);
        const Sweep still(tool_, grid, pose, pose, smooth ? kWallReach : 0.0);
        const double beyond_mm = smooth ? still.far_mm() / kWallReach : 0.0;
        const double deep_mm = std::max(still.far_mm(), operation_.falloff_mm);
        for_each_near(still, grid, brick.position, valid, deep_mm, stop,
                      [&](glm::uvec3 place, Sweep::Near at) {
                          const double weight =
                              depth_weight(-at.mm, operation_.falloff_mm, beyond_mm);
                          if (weight == 0.0)
                              return;
                          const uint32_t offset = offset_in_brick(place);
                          if (brick.dose.empty())
                              brick.dose.assign(kBrickSamples, 0.0);
                          brick.dose[offset] += weight * (seconds / parts);
                          fresh.row(place.y, place.z) |= uint32_t{1} << place.x;
                          if (!smooth)
                              return;
                          if (brick.samples.empty())
                              brick.samples.assign(kBrickSamples, float{kWallReach});
                          float& nearest = brick.samples[offset];
                          nearest = std::min(nearest, static_cast<float>(at.samples()));
                      });
    }
}

void StrokeRun::keep_values(SampleMask& mask, glm::uvec3 brick) const {
    if (!operation_.only_values)
        return;
    const auto [low, high] = *operation_.only_values;
    keep_where(mask, (operation_.on_labels() ? *guide_ : before_).brick(brick),
               [&, low = low, high = high](double v) { return v >= low && v <= high; });
}

void StrokeRun::keep_area(SampleMask& mask, glm::uvec3 brick) const {
    if (area_.empty() || mask.empty())
        return;
    keep_where(mask, (operation_.on_labels() ? before_ : *guide_).brick(brick),
               [&](double label) { return area_[static_cast<uint16_t>(label)]; });
}

// Grey values alone: without the samples under spared labels.
void StrokeRun::keep_unspared(Touched& brick, SampleMask& mask) const {
    if (operation_.on_labels() || operation_.spared.empty() || mask.empty())
        return;
    const Brick& labels = guide_->brick(brick.position);
    const Brick::Pinned pinned = labels.pin();
    for (uint32_t z = 0; z < kBrickSide; ++z)
        for (uint32_t y = 0; y < kBrickSide; ++y) {
            uint32_t& row = mask.row(y, z);
            uint32_t kept = row;
            for_each_bit(row, [&](uint32_t x) {
                const auto label =
                    static_cast<uint16_t>(labels.value(pinned, offset_in_brick({x, y, z})));
                if (freedoms_[label] != Freedom::spared)
                    return;
                kept &= ~(uint32_t{1} << x);
                note_met(brick.met_spared, label);
            });
            row = kept;
        }
}

// A cut brings a sample to this value; a mill brings none beyond it.
double StrokeRun::wall_value(const Touched& brick, double value, glm::ivec3 place) const {
    const double to = *operation_.to_value;
    if (brick.samples.empty())
        return to;
    const double share = share_taken(brick.samples[offset_in_brick(glm::uvec3(place))],
                                     share_at_surface(value, to, operation_.surface_value));
    return share >= 1.0 ? to : value + share * (to - value);
}

template <class T>
void StrokeRun::change(Touched& brick, const SampleMask& fresh, std::span<T> out,
                       const std::stop_token& stop) const {
    const Brick& source = before_.brick(brick.position);
    const BrickSamples<T> in = source.samples<T>();
    const uint32_t stride = source.stride();
    const Operation& op = operation_;
    // f(value of S', place in the brick) is the new value.
    const auto for_all = [&](auto&& f) {
        for (uint32_t z = 0; z < kBrickSide; ++z)
            for (uint32_t y = 0; y < kBrickSide && !stop.stop_requested(); ++y)
                for_each_bit(fresh.row(y, z), [&](uint32_t x) {
                    const uint32_t at = offset_in_brick({x, y, z});
                    out[at] = f(in[stride * at], glm::ivec3(x, y, z));
                });
    };
    const auto label = static_cast<T>(op.label);
    // Asked of samples that change if it says so.
    const auto may_change = [&](T v) {
        const Freedom freedom = freedoms_[static_cast<uint16_t>(v)];
        if (freedom == Freedom::spared)
            note_met(brick.met_spared, static_cast<uint16_t>(v));
        return freedom == Freedom::free;
    };
    // The labels that samples of this brick read, `reach` around them.
    const auto labels_around = [&](glm::ivec3 reach) {
        const Bounds bounds = bounds_of(fresh);
        const glm::ivec3 origin(brick.position * kBrickSide);
        LabelBox box =
            read_labels(before_, origin + bounds.low - reach, origin + bounds.high + reach);
        box.low -= origin; // now in the brick's own places
        return box;
    };
    switch (op.kind) {
        case OperationKind::draw:
            return for_all([&](T v, glm::ivec3) { return may_change(v) ? label : v; });
        case OperationKind::erase:
            return for_all([&](T v, glm::ivec3) { return may_change(v) ? T{0} : v; });
        case OperationKind::cut:
            return for_all([&](T v, glm::ivec3 p) {
                return has_data(v) ? nearest_stored<T>(wall_value(brick, double(v), p)) : v;
            });
        case OperationKind::mill:
            return for_all([&](T v, glm::ivec3 p) {
                if (!has_data(v))
                    return v;
                const double dose = brick.dose[offset_in_brick(glm::uvec3(p))];
                return nearest_stored<T>(
                    milled(v, rate_at(op.rates, v), dose, wall_value(brick, double(v), p)));
            });
        case OperationKind::erode:
        case OperationKind::dilate: {
            const bool erode = op.kind == OperationKind::erode;
            const LabelBox box = labels_around(glm::ivec3(1));
            std::vector<ptrdiff_t> steps;
            for (const glm::ivec3 o : neighbour_offsets(op.neighbours))
                steps.push_back(o.x + ptrdiff_t(box.size.x) * (o.y + ptrdiff_t(box.size.y) * o.z));
            return for_all([&](T v, glm::ivec3 p) {
                if ((v == label) != erode)
                    return v;
                const int32_t* here = box.values.data() + box.at(p);
                for (const ptrdiff_t step : steps)
                    if (erode ? here[step] >= 0 && here[step] != op.label : here[step] == op.label)
                        return erode ? T{0} : may_change(v) ? label : v;
                return v;
            });
        }
        case OperationKind::smooth: {
            // Ball rows: which x of the row (dy, dz) lie within the radius.
            struct Row {
                int y, z, first, last;
            };
            const glm::dmat3 mm(before_.grid().world_from_index);
            const glm::dmat3 rows = glm::transpose(glm::inverse(mm));
            const glm::ivec3 reach(
                glm::floor(op.radius_mm * glm::dvec3(glm::length(rows[0]), glm::length(rows[1]),
                                                     glm::length(rows[2])) +
                           1e-6));
            std::vector<Row> ball;
            for (int z = -reach.z; z <= reach.z; ++z)
                for (int y = -reach.y; y <= reach.y; ++y) {
                    Row row{y, z, 1, 0};
                    for (int x = -reach.x; x <= reach.x; ++x)
                        if (glm::length(mm * glm::dvec3(x, y, z)) <= op.radius_mm) {
                            if (row.first > row.last)
                                row.first = x;
                            row.last = x;
                        }
                    if (row.first <= row.last)
                        ball.push_back(row);
                }
            LabelBox box = labels_around(reach + glm::ivec3(1, 0, 0));
            // Along rows, the running sum of +1 for L, -1 for others, 0 beyond the volume.
            for (int z = 0; z < box.size.z; ++z)
                for (int y = 0; y < box.size.y; ++y) {
                    int32_t* row = box.row(y, z);
                    int32_t sum = 0;
                    for (int x = 0; x < box.size.x; ++x)
                        row[x] = sum += row[x] < 0 ? 0 : row[x] == op.label ? 1 : -1;
                }
            return for_all([&](T v, glm::ivec3 p) {
                int64_t excess = 0;
                for (const Row& row : ball)
                    excess += box.values[box.at(p + glm::ivec3(row.last, row.y, row.z))] -
                              box.values[box.at(p + glm::ivec3(row.first - 1, row.y, row.z))];
                if (excess > 0 && v != label && may_change(v))
                    return label;
                return excess < 0 && v == label ? T{0} : v;
            });
        }
        case OperationKind::fill:
        case OperationKind::islands:
            return;
    }
}

Volume StrokeRun::publish() {
    PALPATE_ASSERT(!stopped_);
    if (edit_) {
        const profile::Scope scope("publish");
        now_ = edit_->commit();
        edit_.reset();
    }
    return now_.is_same_as(before_) ? given_ : now_;
}

Result<Volume> apply_stroke(const Volume& before, const Tool& tool, const Operation& operation,
                            std::span<const StrokePose> poses, std::optional<Volume> guide) {
    PALPATE_TRY(const std::unique_ptr<StrokeRun> run,
                StrokeRun::start(before, tool, operation, std::move(guide)));
    run->add(poses);
    run->lift();
    run->work();
    return run->publish();
}

} // namespace palpate
