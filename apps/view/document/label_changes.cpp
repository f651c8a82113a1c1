#include "apps/view/document/label_changes.h"

#include <algorithm>
#include <array>

#include "engine/segment/components.h"
#include "engine/segment/interpolate_slices.h"
#include "engine/segment/map_values.h"
#include "engine/segment/morphology.h"
#include "engine/segment/smooth_labels.h"

namespace palpate::view {

namespace {

// The label alone: 1 where it is.
Result<Volume> alone(const Volume& labels, uint16_t label, const Task& task) {
    return map_values<uint8_t>(std::array{&labels}, task, [label](std::array<float, 1> values) {
        return static_cast<uint8_t>(values[0] == static_cast<float>(label));
    });
}

// The map with the label where `found` is not 0, and other labels where they were.
template <class T>
Result<Volume> put_typed(const Volume& labels, const Volume& found, uint16_t label,
                         const Task& task) {
    return map_values<T>(std::array{&labels, &found}, task, [label](std::array<float, 2> values) {
        const auto before = static_cast<uint16_t>(values[0] > 0.0f ? values[0] : 0.0f);
        const bool is_free = before == 0 || before == label;
        return static_cast<T>(!is_free ? before : values[1] > 0.0f ? label : 0);
    });
}
Result<Volume> put(const Volume& labels, const Volume& found, uint16_t label, const Task& task) {
    return labels.type() == ScalarType::u8 ? put_typed<uint8_t>(labels, found, label, task)
                                           : put_typed<uint16_t>(labels, found, label, task);
}

Result<Volume> keep_largest(const Volume& labels, uint16_t label, double, const Task& task) {
    return remove_islands(labels, {.label = label, .largest_alone = true}, task);
}

Result<Volume> fill(const Volume& labels, uint16_t label, double, const Task& task) {
    return fill_holes(labels, {.label = label}, task);
}

Result<Volume> smooth(const Volume& labels, uint16_t label, double by_mm, const Task& task) {
    PALPATE_TRY(const Volume object, alone(labels, label, task.part(0.0, 0.1)));
    PALPATE_TRY(const Volume smooth,
                smooth_labels(object, {.sigma_mm = by_mm}, task.part(0.1, 0.9)));
    return put(labels, smooth, label, task.part(0.9, 1.0));
}

Result<Volume> step(const Volume& labels, uint16_t label, double by_mm, MorphologyStep how,
                    const Task& task) {
    return morphology(labels, {.step = how, .radius_mm = by_mm, .label = label}, task);
}
Result<Volume> grow(const Volume& labels, uint16_t label, double by_mm, const Task& task) {
    return step(labels, label, by_mm, MorphologyStep::dilate, task);
}
Result<Volume> shrink(const Volume& labels, uint16_t label, double by_mm, const Task& task) {
    return step(labels, label, by_mm, MorphologyStep::erode, task);
}

Result<Volume> fill_between(const Volume& labels, uint16_t label, double, const Task& task) {
    return interpolate_slices(labels, {.label = label}, task);
}

constexpr LabelChange kChanges[] = {
    {"largest", "largest piece", "in its largest piece", "is in one piece", false, keep_largest},
    {"fill", "fill holes", "with its holes filled",
     "has no hole that is closed in 3D (in a slice one may look closed)", false, fill},
    {"between", "between slices", "with the slices between filled",
     "has no empty slices between those that were drawn", false, fill_between},
    {"smooth", "smooth", "smoothed", "is as smooth as that already", true, smooth},
    {"grow", "grow", "grown", "has no free sample beside it that is so near", true, grow},
    {"shrink", "shrink", "shrunk", "loses no sample by so little", true, shrink},
};

} // namespace

std::span<const LabelChange> label_changes() {
    return kChanges;
}

const LabelChange& label_change(std::string_view id) {
    return *std::find_if(std::begin(kChanges), std::end(kChanges),
                         [&](const LabelChange& one) { return id == one.id; });
}

} // namespace palpate::view
