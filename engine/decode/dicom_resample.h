#pragma once

#include <functional>

#include "engine/decode/dicom_stack.h"

namespace palpate::io {

// The samples of an image of a stack as physical values, x fastest.
using DicomValues = std::function<Result<std::vector<double>>(const DicomFrame&)>;

// Fills the samples of stack.grid, of a stack that is to be resampled: linear between the two
// images around each slice of the grid, and bilinear within them, since an image may lie between
// the grid's rows and columns. NaN where no image lies. A field that is linear in world space is
// met exactly but for rounding. `values_of` is called once for each image, in the order of the
// stack.
Result<void> resample_stack(const DicomStack& stack, const DicomValues& values_of,
                            std::span<float> out);

} // namespace palpate::io
