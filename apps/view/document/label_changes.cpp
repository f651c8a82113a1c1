#include "apps/view/document/label_changes.h"

#include <algorithm>
#include <array>

#include "engine/segment/components.h"
#include "engine/segment/interpolate_slices.h"
#include "engine/segment/label_logic.h"
#include "engine/segment/label_median.h"
#include "engine/segment/map_values.h"
#include "engine/segment/margin.h"
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

Result<Volume> keep_largest(const Volume& labels, const LabelChangeInput& in, const Task& task) {
    return remove_islands(labels, {.label = in.label, .largest_alone = true}, task);
}

uint16_t label_at(const Volume& labels, glm::uvec3 at) {
    const float value = labels.value(at);
    return value > 0.0f ? static_cast<uint16_t>(value) : uint16_t{0};
}
Result<Volume> keep_piece_at(const Volume& labels, const LabelChangeInput& in, const Task& task) {
    if (const uint16_t found = label_at(labels, in.at); found != in.label)
        return fail("expected the crosshair on label {}, found it on {}", in.label, found);
    return keep_piece(labels, {.at = in.at}, task);
}
Result<Volume> split(const Volume& labels, const LabelChangeInput& in, const Task& task) {
    return split_pieces(labels, {.label = in.label, .locked = in.locked}, task);
}

Result<Volume> fill(const Volume& labels, const LabelChangeInput& in, const Task& task) {
    return fill_holes(labels, {.label = in.label}, task);
}
Result<Volume> fill_between(const Volume& labels, const LabelChangeInput& in, const Task& task) {
    return interpolate_slices(labels, {.label = in.label}, task);
}

Result<Volume> invert(const Volume& labels, const LabelChangeInput& in, const Task& task) {
    return label_logic(labels, {.logic = LabelLogic::invert, .label = in.label}, task);
}
Result<Volume> add_other(const Volume& labels, const LabelChangeInput& in, const Task& task) {
    const uint16_t other = label_at(labels, in.at);
    if (other == 0 || other == in.label)
        return fail("expected the crosshair on another label than {}, found it on {}", in.label,
                    other);
    return label_logic(
        labels, {.logic = LabelLogic::add, .label = in.label, .of = other, .locked = in.locked},
        task);
}

Result<Volume> smooth(const Volume& labels, const LabelChangeInput& in, const Task& task) {
    PALPATE_TRY(const Volume object, alone(labels, in.label, task.part(0.0, 0.1)));
    PALPATE_TRY(const Volume smooth,
                smooth_labels(object, {.sigma_mm = in.by_mm}, task.part(0.1, 0.9)));
    return put(labels, smooth, in.label, task.part(0.9, 1.0));
}
Result<Volume> smooth_all(const Volume& labels, const LabelChangeInput& in, const Task& task) {
    return smooth_labels(
        labels, {.sigma_mm = in.by_mm, .locked = {in.locked.begin(), in.locked.end()}}, task);
}
Result<Volume> median(const Volume& labels, const LabelChangeInput& in, const Task& task) {
    PALPATE_TRY(const Volume object, alone(labels, in.label, task.part(0.0, 0.1)));
    PALPATE_TRY(const BrickMaker maker, label_median_bricks(object, {in.by_mm, {}}));
    PALPATE_TRY(const Volume voted, make_bricks(maker, task.part(0.1, 0.9)));
    return put(labels, voted, in.label, task.part(0.9, 1.0));
}

template <MorphologyStep kStep>
Result<Volume> step(const Volume& labels, const LabelChangeInput& in, const Task& task) {
    return morphology(labels, {.step = kStep, .radius_mm = in.by_mm, .label = in.label}, task);
}
Result<Volume> grow(const Volume& labels, const LabelChangeInput& in, const Task& task) {
    return margin(labels, in.by_mm, {.label = in.label}, task);
}
Result<Volume> shrink(const Volume& labels, const LabelChangeInput& in, const Task& task) {
    return margin(labels, -in.by_mm, {.label = in.label}, task);
}
template <Wall kWall>
Result<Volume> leave_wall(const Volume& labels, const LabelChangeInput& in, const Task& task) {
    return hollow(labels, in.by_mm, kWall, {.label = in.label}, task);
}

constexpr LabelChange kChanges[] = {
    {"largest", "largest piece", "in its largest piece", "is in one piece", false, false,
     keep_largest, true},
    {"piece", "piece here", "in the piece at the crosshair", "is in one piece", false, false,
     keep_piece_at},
    {"split", "split pieces", "in its largest piece, the others as new labels", "is in one piece",
     false, true, split},
    {"fill", "fill holes", "with its holes filled",
     "has no hole that is closed in 3D (in a slice one may look closed)", false, false, fill, true},
    {"between", "between slices", "with the slices between filled",
     "has no empty slices between those that were drawn", false, false, fill_between, true},
    {"invert", "invert", "in what was free", "has neither samples nor free ones", false, false,
     invert},
    {"add", "add label here", "with the label at the crosshair", "takes no sample", false, true,
     add_other},
    {"smooth", "smooth", "smoothed", "is as smooth as that already", true, false, smooth, true},
    {"joint", "smooth all", "smoothed with all others", "is as smooth as that, and so are all",
     true, true, smooth_all},
    {"median", "median", "by the median", "is as smooth as that already", true, false, median},
    {"opened", "open", "without thin parts", "has no part so thin", true, false,
     step<MorphologyStep::open>},
    {"closed", "close", "with gaps closed", "has no free gap so narrow", true, false,
     step<MorphologyStep::close>},
    {"grow", "grow", "grown", "has no free sample beside it that is so near", true, false, grow,
     true},
    {"shrink", "shrink", "shrunk", "loses no sample by so little", true, false, shrink, true},
    {"inside", "wall inside", "as a wall within it", "is as thin as that already", true, false,
     leave_wall<Wall::inside>},
    {"middle-wall", "wall middle", "as a wall on both sides of its border",
     "is as thin as that already", true, false, leave_wall<Wall::middle>},
    {"outside", "wall outside", "as a wall around it", "has neither samples nor free ones", true,
     false, leave_wall<Wall::outside>},
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
