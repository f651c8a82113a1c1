#pragma once

#include <map>
#include <string>
#include <string_view>

#include "engine/segment/brick_maker.h"

// Filters that make a sample from the samples at its place in one or several volumes. All volumes
// lie on one grid; others are refused. Memory: a brick of each input for each thread. A sample
// without data stays without data.
namespace palpate {

// Result<void> with a sentence that begins with `name` where `volume` does not lie on the grid:
// another size, or a corner more than a ten-thousandth of a sample away.
Result<void> expect_grid(const Grid& grid, const Volume& volume, std::string_view name);

// An expression (expression.h) of `volume`, known as `a`, and of `others` by their names. u8 where
// it is logical (no data becomes 0), else f32.
Result<BrickMaker> expression_bricks(const Volume& volume, std::string_view text,
                                     const std::map<std::string, Volume>& others);

// 1 where low <= value <= high, else 0, and 0 without data; u8.
Result<BrickMaker> threshold_bricks(const Volume& volume, double low, double high);

// Values limited to low .. high, in the type of the input.
Result<BrickMaker> clamp_bricks(const Volume& volume, double low, double high);

// The straight line that takes low to `to_low` and high to `to_high`, f32; values beyond go on.
Result<BrickMaker> rescale_bricks(const Volume& volume, double low, double high, double to_low,
                                  double to_high);

// Least and greatest value of the volume change places: least + greatest - value, in its type.
Result<BrickMaker> invert_bricks(const Volume& volume);

// `outside` where the mask is 0 or has no data, else the value; in the type of the input, which
// must hold `outside`.
Result<BrickMaker> mask_bricks(const Volume& volume, const Volume& mask, double outside);

} // namespace palpate
