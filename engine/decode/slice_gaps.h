#pragma once

#include <cstddef>
#include <string>
#include <vector>

// The gaps between slices of a stack, in words and as a lattice.
namespace palpate::io {

// Gaps that follow one another and agree within 1 % or kPositionRoundingMm.
struct GapRun {
    size_t first = 0, count = 0; // between slice `first` and `first + 1`, and so on
    double gap_mm = 0;           // their mean
};

// `along_mm`: where the slices lie along their normal, rising; two or more.
std::vector<GapRun> gap_runs(const std::vector<double>& along_mm);

// "13 slices 4.22 mm apart (at -120 .. -69.4 mm), then a gap of 1.14 mm, then 20 slices 7.38 mm
// apart (at -68.2 .. 72 mm)"; the extremes alone where there are more than six runs.
std::string gap_words(const std::vector<double>& along_mm);

// How many slices are missing before each slice of a lattice with holes: the gaps are whole
// multiples, within 5 %, of the one that occurs most. Empty where they are not.
std::vector<size_t> missing_before(const std::vector<double>& along_mm);

// The smallest spacing between three or more slices in a row; the smallest of all where no two
// gaps in a row agree.
double finest_spacing_mm(const std::vector<double>& along_mm);

} // namespace palpate::io
