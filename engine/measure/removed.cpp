#include "engine/measure/removed.h"

#include <vector>

namespace palpate {

namespace {

RemovedSamples count_brick(const Brick& before, const Brick& now, const Brick* labels,
                           glm::uvec3 valid, double iso) {
    const Brick::Pinned before_pin = before.pin(), now_pin = now.pin();
    std::optional<Brick::Pinned> label_pin;
    if (labels)
        label_pin.emplace(labels->pin());
    RemovedSamples removed;
    for (uint32_t z = 0; z < valid.z; ++z)
        for (uint32_t y = 0; y < valid.y; ++y)
            for (uint32_t x = 0; x < valid.x; ++x) {
                const uint32_t at = offset_in_brick({x, y, z});
                // A sample without data is not solid.
                if (!(before.value(before_pin, at) >= iso) || now.value(now_pin, at) >= iso)
                    continue;
                const float label = labels ? labels->value(*label_pin, at) : 0.0f;
                ++removed[static_cast<uint16_t>(label)];
            }
    return removed;
}

} // namespace

void RemovedCounter::begin(Volume before) {
    before_ = std::move(before);
    bricks_.clear();
    all_.clear();
    is_counted_ = false;
}

const RemovedSamples& RemovedCounter::count(const Volume& now, double iso,
                                            const std::optional<Volume>& labels) {
    if (!before_ || before_->grid() != now.grid() || before_->type() != now.type())
        begin(now);
    const bool has_labels = labels && labels->grid() == now.grid();
    const uint64_t labels_version = has_labels ? labels->version() : 0;
    if (is_counted_ && iso == iso_ && now.version() == now_version_ &&
        labels_version == labels_version_)
        return all_;
    if (iso != iso_)
        bricks_.clear();
    std::unordered_map<uint64_t, Counted> bricks;
    RemovedSamples all;
    const glm::uvec3 count = now.brick_count();
    for_each_brick(now, [&](glm::uvec3 at) {
        const BrickPtr brick = now.brick_ptr(at);
        if (brick == before_->brick_ptr(at))
            return;
        const BrickPtr label = has_labels ? labels->brick_ptr(at) : nullptr;
        const uint64_t place = at.x + count.x * (at.y + uint64_t{count.y} * at.z);
        const auto known = bricks_.find(place);
        Counted counted =
            known != bricks_.end() && known->second.now == brick && known->second.labels == label
                ? std::move(known->second)
                : Counted{brick, label,
                          count_brick(before_->brick(at), *brick, label.get(),
                                      now.valid_in_brick(at), iso)};
        for (const auto& [of, samples] : counted.removed)
            all[of] += samples;
        bricks.emplace(place, std::move(counted));
    });
    bricks_ = std::move(bricks);
    all_ = std::move(all);
    iso_ = iso;
    now_version_ = now.version();
    labels_version_ = labels_version;
    is_counted_ = true;
    return all_;
}

} // namespace palpate
