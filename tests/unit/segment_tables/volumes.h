#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "engine/segment/filters.h"
#include "engine/segment/methods.h"
#include "engine/volume/volume.h"

// The volumes that every row of the tables of filters and methods must take, and a row's name.
namespace palpate::tables {

struct VolumeCase {
    std::string name;
    Volume volume;
    bool sheared = false; // may be refused, by a sentence that says so
};

// Types, grids, shapes and contents: u8, i16, f32; unequal spacing, turned, mirrored and sheared
// axes; one sample thin along each axis, and one sample in all; constant, 0, and f32 with patches
// without data, and with no data at all. Of labels: whole numbers 0 .. 3.
std::vector<VolumeCase> volumes(bool labels);

// Whole numbers of the same places as in volumes().
Volume sampled(const Grid& grid, ScalarType type, bool labels);

struct FilterUse {
    std::string name;
    FilterValues values;
};
// A filter with values of its own, and once more with each word of its parameters. `others` is what
// text filters name: "b" on the grid of the volume, "other" on another one.
std::vector<FilterUse> uses_of(const Filter& filter, const std::map<std::string, Volume>& others);
std::map<std::string, Volume> others_of(const Volume& volume);

// A method on a volume, with seeds of label 1 in its middle, and of the background in a corner
// where that is another sample.
SegmentInput input_of(const SegmentMethod& method, const Volume& volume);
ParameterValues values_of(const SegmentMethod& method);

// Whether both are made, of one grid and type, with equal bits, or fail with one sentence.
testing::AssertionResult same(const Result<Volume>& a, const Result<Volume>& b);

// The name of a row as GoogleTest allows it.
std::string test_name(std::string row);

bool says_sheared(const std::string& message);

} // namespace palpate::tables
