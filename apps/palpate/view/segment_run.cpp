#include "apps/palpate/view/segment_run.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "engine/segment/arrival_threshold.h"
#include "engine/segment/label_merge.h"

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

} // namespace

SegmentRun::SegmentRun(SegmentJob job, bool threaded) : job_(std::move(job)), threaded_(threaded) {
    result_ =
        std::async(threaded ? std::launch::async : std::launch::deferred, [this] { return run(); });
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

Result<SegmentDone> SegmentRun::run() {
    Task task{stop_.get_token(), [this](double share) { share_ = share; }};
    if (threaded_)
        task.look = [this](const std::function<Volume()>& make) { look(make); };
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
    PALPATE_TRY(Segmented found, segment(*job_.method, input, job_.given, task.part(0.0, 0.95)));
    if (!job_.seeds)
        for (const LabelCount& one : label_counts(found.labels))
            of.push_back(one.label);
    SegmentDone done{job_.labels, {}, std::move(found.found), std::move(found.notes)};
    if (found.unbounded.empty()) { // else there is nothing to put in yet
        PALPATE_TRY(done.labels,
                    with_labels(job_.labels, found.labels, of, job_.locked, task.part(0.95, 1.0)));
    }
    if (!found.strength)
        return done;
    Strength strength{job_.method, std::move(*found.strength), std::move(*found.owner),
                      std::move(of)};
    strength.unbounded = std::move(found.unbounded);
    if (!is_object_below(*job_.method)) {
        strength.bound = weakest(strength.volume, found.labels, false); // of 0 .. 1
    } else {
        PALPATE_TRY(const ArrivalGrowth growth, arrival_growth(strength.volume, {task.stop, {}}));
        strength.least = growth.times.empty() ? 0.0 : growth.times.front();
        strength.most = growth.times.empty() ? 0.0 : growth.times.back();
        strength.bound = strength.unbounded.empty() ? weakest(strength.volume, found.labels, true)
                                                    : std::sqrt(strength.least * strength.most);
    }
    if (const auto given = job_.given.find("threshold"); given != job_.given.end())
        strength.bound = given->second;
    if (is_object_below(*job_.method) && strength.unbounded.empty()) {
        const double least = std::max(strength.least, strength.bound / kTimesTheBound),
                     most = std::min(strength.most, strength.bound * kTimesTheBound);
        if (least < most) // else the bound lies beyond the front
            strength.least = least, strength.most = most;
    }
    done.strength = std::move(strength);
    return done;
}

Result<SegmentDone> SegmentRun::bound_again(const Task& task) {
    const Strength& by = *job_.again;
    PALPATE_TRY(const Volume found, bounded_labels(by.volume, by.owner, is_object_below(*by.method),
                                                   by.bound, task.part(0.0, 0.5)));
    PALPATE_TRY(Volume labels,
                with_labels(job_.labels, found, by.of, job_.locked, task.part(0.5, 1.0)));
    SegmentDone done{std::move(labels), by, {}, {}};
    done.strength->unbounded.clear();
    return done;
}

} // namespace palpate::view
