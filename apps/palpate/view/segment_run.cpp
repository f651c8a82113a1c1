#include "apps/palpate/view/segment_run.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "engine/segment/label_merge.h"

namespace palpate::view {

namespace {

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

bool is_object_below(const SegmentMethod& method) {
    return method.strength && std::string_view(method.strength).starts_with("arrival");
}

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
    std::vector<uint16_t> of;
    SegmentInput input{job_.volume, job_.seeds, {}, 0};
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
    PALPATE_TRY(Volume labels,
                with_labels(job_.labels, found.labels, of, job_.locked, task.part(0.95, 1.0)));
    const double threshold =
        found.strength ? weakest(*found.strength, found.labels, is_object_below(*job_.method))
                       : 0.0;
    return SegmentDone{std::move(labels), std::move(found.strength), threshold,
                       std::move(found.notes)};
}

} // namespace palpate::view
