#include "apps/view/document/segment_run.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/failure.h"
#include "engine/edit/spared.h"
#include "engine/segment/grid_change.h"
#include "engine/segment/label_merge.h"
#include "engine/segment/map_values.h"
#include "engine/volume/content_hash.h"

namespace palpate::view {

namespace {

constexpr double kTimesTheBound = 16.0; // to the ends of its slider: times move over 8 octaves

// The strength of the weakest sample of the result: the largest time, or the least connectedness.
double weakest(const Volume& strength, const Volume& labels, bool below) {
    double found = below ? 0.0 : std::numeric_limits<double>::infinity();
    for_each_brick(labels, [&](glm::uvec3 at) {
        const Brick& label = labels.brick(at);
        const Brick& value = strength.brick(at);
        if (label.range().max == 0.0f)
            return;
        const Brick::Pinned label_pin = label.pin(), value_pin = value.pin();
        const glm::uvec3 valid = labels.valid_in_brick(at);
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x) {
                    const uint32_t i = offset_in_brick({x, y, z});
                    const double v = value.value(value_pin, i);
                    if (label.value(label_pin, i) != 0.0f && !std::isnan(v))
                        found = below ? std::max(found, v) : std::min(found, v);
                }
    });
    return found;
}

// A strength where its owner is one of some labels; no data elsewhere.
Result<Volume> only(const Volume& strength, const Volume& owner, const std::vector<uint16_t>& of,
                    const Task& task) {
    std::vector<bool> stays(65536);
    for (const uint16_t label : of)
        stays[label] = true;
    return map_values<float>(std::array{&strength, &owner}, task, [&](std::array<float, 2> v) {
        return stays[size_t(v[1])] ? v[0] : std::numeric_limits<float>::quiet_NaN();
    });
}

// The map `now` with what `done` has changed in `before`; what has changed in it since stays.
Result<Volume> merged(const Volume& before, const Volume& done, const Volume& now,
                      const Task& task) {
    if (now.grid() != before.grid())
        return fail("expected the labels on their grid, found another");
    const auto label_of = [&](std::array<float, 3> v) { return v[2] != v[0] ? v[2] : v[1]; };
    const std::array<const Volume*, 3> maps{&before, &done, &now};
    if (done.type() == ScalarType::u8 && now.type() == ScalarType::u8)
        return map_values<uint8_t>(maps, task, [&](auto v) { return uint8_t(label_of(v)); });
    return map_values<uint16_t>(maps, task, [&](auto v) { return uint16_t(label_of(v)); });
}

} // namespace

SegmentRun::SegmentRun(SegmentJob job, bool threaded) : job_(std::move(job)), threaded_(threaded) {
    result_ = std::async(threaded ? std::launch::async : std::launch::deferred, [this] {
        return attempt(job_.method ? job_.method->name : "segmentation", [this] { return run(); });
    });
    if (!threaded)
        result_.wait();
}

SegmentRun::~SegmentRun() {
    stop();
    if (result_.valid())
        result_.wait();
}

std::optional<Result<SegmentDone>> SegmentRun::take() {
    if (!result_.valid() || result_.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
        return std::nullopt;
    return result_.get();
}

void SegmentRun::look(const std::function<Volume()>& make) {
    constexpr int kTimesAsLong = 4; // the method goes on
    const auto begin = std::chrono::steady_clock::now();
    if (begin < next_look_)
        return;
    Volume made = make();
    const auto end = std::chrono::steady_clock::now();
    next_look_ = end + std::max<std::chrono::steady_clock::duration>(kLookEvery,
                                                                     kTimesAsLong * (end - begin));
    const std::lock_guard lock(mutex_);
    look_ = std::move(made);
}

std::optional<Volume> SegmentRun::take_look() {
    const std::lock_guard lock(mutex_);
    return std::exchange(look_, std::nullopt);
}

namespace {

Result<Volume> made(const Result<BrickMaker>& maker, const Task& task) {
    if (!maker)
        return fail("{}", maker.error().message);
    return make_bricks(*maker, task);
}

} // namespace

Result<Segmented> SegmentRun::run_method(SegmentInput input, const Task& task) {
    input.kept = &job_.kept;
    if (!job_.region)
        return segment(*job_.method, input, job_.given, task);
    const auto [low, high] = *job_.region;
    const glm::ivec3 behind = glm::ivec3(input.volume.size()) - 1 - high;
    job_.kept.reset(); // a part is a volume of its own
    const Task quietly{task.stop, {}};
    PALPATE_TRY(const Volume part, made(crop_bricks(input.volume, low, high), quietly));
    SegmentInput within{part, {}, {}, input.background};
    within.keeps_unbounded = input.keeps_unbounded;
    if (input.seeds) {
        PALPATE_TRY(within.seeds, made(crop_bricks(*input.seeds, low, high), quietly));
    }
    // Pictures on the way would lie on the part's grid: they are left out.
    PALPATE_TRY(Segmented found,
                segment(*job_.method, within, job_.given, {task.stop, task.progress}));
    PALPATE_TRY(found.labels, made(pad_bricks(found.labels, low, behind, 0.0), quietly));
    if (found.strength) {
        PALPATE_TRY(found.strength,
                    made(pad_bricks(*found.strength, low, behind, std::nan("")), quietly));
        PALPATE_TRY(found.owner, made(pad_bricks(*found.owner, low, behind, 0.0), quietly));
    }
    return found;
}

Result<SegmentDone> SegmentRun::run() {
    Task task{stop_.get_token(), [this](double share) { share_ = share; }};
    if (threaded_)
        task.look = [this](const std::function<Volume()>& make) { look(make); };
    if (job_.ready) {
        SegmentDone done = *job_.ready;
        PALPATE_TRY(done.labels, merged(*job_.before, done.labels, job_.labels, task));
        spare_locked(done);
        return done;
    }
    if (job_.again)
        return bound_again(task);
    std::vector<uint16_t> of;
    SegmentInput input{job_.volume, job_.seeds, {}, 0};
    input.keeps_unbounded = true;
    if (job_.seeds)
        for (const LabelCount& one : label_counts(*job_.seeds)) {
            if (one.label == job_.outside)
                input.background = job_.outside;
            else
                of.push_back(one.label);
        }
    PALPATE_TRY(Segmented found, run_method(std::move(input), task.part(0.0, 0.95)));
    if (!job_.seeds)
        for (const LabelCount& one : label_counts(found.labels))
            of.push_back(one.label);
    std::vector<std::string> notes = std::move(found.notes);
    std::erase_if(notes, [&](const std::string& note) { // the outside is no label to a person
        return note.starts_with(fmt::format("label {}:", job_.outside));
    });
    std::vector<uint16_t> bounded = of, unbounded;
    for (const Unbounded& one : found.unbounded) {
        unbounded.push_back(one.label);
        notes.push_back(one.why);
        std::erase(bounded, one.label); // what the map has of it stays
    }
    SegmentDone done{job_.labels,      {},           std::move(found.found),
                     std::move(notes), found.labels, bounded};
    if (!bounded.empty()) {
        PALPATE_TRY(done.labels,
                    with_labels(job_.labels, found.labels, bounded, task.part(0.95, 1.0)));
        spare_locked(done);
    }
    if (!found.strength || of.empty())
        return done;
    Strength strength{job_.method, std::move(*found.strength), std::move(*found.owner),
                      unbounded.empty() ? of : unbounded};
    strength.is_unbounded = !unbounded.empty();
    if (std::ranges::find(strength.of, job_.label) != strength.of.end())
        strength.of = {job_.label};
    if (strength.of.size() < of.size()) {
        PALPATE_TRY(strength.volume,
                    only(strength.volume, strength.owner, strength.of, {task.stop, {}}));
    }
    PALPATE_TRY(const ArrivalGrowth growth, is_object_below(*job_.method)
                                                ? arrival_growth(strength.volume, {task.stop, {}})
                                                : Result<ArrivalGrowth>());
    set_bound(strength, done, growth);
    strength.id = fmt::format("{:016x}", content_hash(strength.volume));
    done.strength = std::move(strength);
    return done;
}

void SegmentRun::spare_locked(SegmentDone& done) const {
    Spared kept = sparing(job_.labels, done.labels, job_.limits);
    done.labels = std::move(kept.labels);
    done.met_locked = kept.met;
    done.met_mask = kept.met_mask;
}

// The bound that a method has taken, and the ends of its slider.
void SegmentRun::set_bound(Strength& strength, const SegmentDone& found,
                           const ArrivalGrowth& growth) {
    const bool below = is_object_below(*job_.method);
    if (!below) {
        strength.least = std::clamp(double{strength.volume.range().min}, 0.0, 1.0);
    } else {
        strength.least = growth.times.empty() ? 0.0 : growth.times.front();
        strength.most = growth.times.empty() ? 0.0 : growth.times.back();
    }
    strength.bound = strength.is_unbounded ? std::sqrt(strength.least * strength.most)
                                           : weakest(strength.volume, found.objects, below);
    if (const auto stopped = found.found.find("threshold");
        stopped != found.found.end() && found.of.size() == 1 && strength.of == found.of)
        strength.bound = stopped->second; // and not the time of the last sample before it
    if (const auto given = job_.given.find("threshold"); given != job_.given.end())
        strength.bound = given->second;
    if (!below || strength.is_unbounded)
        return;
    const double least = std::max(strength.least, strength.bound / kTimesTheBound),
                 most = std::min(strength.most, strength.bound * kTimesTheBound);
    if (least < most) // else the bound lies beyond the front
        strength.least = least, strength.most = most;
}

Result<SegmentDone> SegmentRun::bound_again(const Task& task) {
    const Strength& by = *job_.again;
    PALPATE_TRY(Volume found, bounded_labels(by.volume, by.owner, is_object_below(*by.method),
                                             by.bound, task.part(0.0, 0.5)));
    PALPATE_TRY(Volume labels, with_labels(job_.labels, found, by.of, task.part(0.5, 1.0)));
    SegmentDone done{std::move(labels), by, {}, {}, std::move(found), by.of};
    done.strength->is_unbounded = false;
    spare_locked(done);
    return done;
}

} // namespace palpate::view
