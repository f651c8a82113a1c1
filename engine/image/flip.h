#pragma once

#include <optional>
#include <vector>

#include "engine/image/image.h"

namespace palpate {

// Pixels per degree of visual angle of a 0.7 m wide screen of 3840 pixels seen from 0.7 m.
constexpr double kFlipPixelsPerDegree = 67.02064327658226;

// The difference a person sees when two pictures take turns on a screen, per pixel from 0 (none) to
// 1, row by row: LDR-FLIP of Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astrom and Fairchild,
// "FLIP: A Difference Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech.
// 3(2), 2020, doi 10.1145/3406183. Samples are sRGB display values, clamped to [0, 1], NaN read as
// black. Uses the channels R, G, B, or Y as all three; nothing where an image has neither. Images
// must be of one size. The method is symmetric in its two images.
//
// Written from the paper's formulas. Checked by tests/unit/image/flip_test.cpp: the published
// properties (identical is 0, symmetry, black against white, green against blue as the largest
// colour error), hand-computed single values, and per-picture means that the authors' evaluator
// (NVlabs/flip 1.7, C++) gave for pictures defined by formula. The mean for the authors' own pair
// of example pictures was not checked.
std::optional<std::vector<double>> flip_map(const Image& reference, const Image& test,
                                            double pixels_per_degree = kFlipPixelsPerDegree);

} // namespace palpate
