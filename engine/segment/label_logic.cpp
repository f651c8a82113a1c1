#include "engine/segment/label_logic.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "engine/segment/label_samples.h"

namespace palpate {

namespace {

// The label of a sample, from its own and whether it is of the set.
uint16_t label_after(const LabelLogicOptions& o, uint16_t own, bool in_set) {
    const bool was = own == o.label;
    switch (o.logic) {
        case LabelLogic::copy:
            return in_set ? o.label : was ? uint16_t{0} : own;
        case LabelLogic::add:
            return in_set ? o.label : own;
        case LabelLogic::subtract:
            return was && in_set ? uint16_t{0} : own;
        case LabelLogic::intersect:
            return was && !in_set ? uint16_t{0} : own;
        case LabelLogic::invert:
            return was ? uint16_t{0} : own == 0 ? o.label : own;
    }
    return own;
}

Result<void> check_logic(const Volume& labels, const LabelLogicOptions& o) {
    PALPATE_TRY(check_labels(labels, "logic of labels"));
    if (o.label == 0)
        return fail("logic of labels: expected a label 1 .. 65535, found 0, the background");
    if (std::find(o.locked.begin(), o.locked.end(), o.label) != o.locked.end())
        return fail("logic of labels: expected a label that is not locked, found {}", o.label);
    if (!o.other)
        return {};
    PALPATE_TRY(check_labels(*o.other, "logic of labels, the second map"));
    const glm::uvec3 found = o.other->size(), size = labels.size();
    if (found != size)
        return fail(
            "logic of labels: expected two maps of one size, found {} x {} x {} and {} x {} x {}",
            size.x, size.y, size.z, found.x, found.y, found.z);
    return {};
}

} // namespace

Result<Volume> label_logic(const Volume& labels, const LabelLogicOptions& options,
                           const Task& task) {
    PALPATE_TRY(check_logic(labels, options));
    std::vector<bool> locked(65536);
    for (const uint16_t label : options.locked)
        locked[label] = label != 0;
    const bool holds = visit_scalar(labels.type(), [&]<class T>(T) {
        return double(options.label) <= double(std::numeric_limits<T>::max());
    });
    const ScalarType type = holds ? labels.type() : ScalarType::u16;
    return make_bricks(labels.grid(), type, task, [&](glm::uvec3 position) {
        const glm::ivec3 first(position * kBrickSide);
        std::vector<uint16_t> before(kBrickSamples), second, after(kBrickSamples);
        read_labels(labels, first, glm::ivec3(kBrickSide), before.data());
        if (options.other) {
            second.resize(kBrickSamples);
            read_labels(*options.other, first, glm::ivec3(kBrickSide), second.data());
        }
        for (size_t i = 0; i < after.size(); ++i) {
            const uint16_t one = options.other ? second[i] : before[i];
            const bool in_set = options.of == 0 ? one != 0 : one == options.of;
            after[i] = locked[before[i]] ? before[i] : label_after(options, before[i], in_set);
        }
        if (after == before && holds && type != ScalarType::f32) // where NaN becomes 0
            return labels.brick_ptr(position);
        return visit_scalar(type, [&]<class T>(T) -> BrickPtr {
            const std::vector<T> typed(after.begin(), after.end());
            return Brick::make(std::span<const T>(typed), labels.valid_in_brick(position));
        });
    });
}

} // namespace palpate
