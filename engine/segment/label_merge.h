#pragma once

#include <cstdint>
#include <span>

#include "engine/segment/task.h"

namespace palpate {

// A label map with what a method found put in: samples of the labels `of` (those that were
// segmented) become 0 first, then samples that `found` gives a label take it. The result has the
// type of the map, or u16 where a label above 255 comes in. Bricks that do not change stay shared;
// where none does, it is the map itself. Refused: maps of two grids, or of another type than u8 and
// u16.
Result<Volume> with_labels(const Volume& map, const Volume& found, std::span<const uint16_t> of,
                           const Task& task);

// The map `after`, but for samples that had a label of `locked` in `before` or get one: they are as
// in `before`. On one grid, of any types that check_labels() accepts, and `after` holds the labels
// of `before`.
Result<Volume> with_locked(const Volume& before, const Volume& after,
                           std::span<const uint16_t> locked, const Task& task);

} // namespace palpate
