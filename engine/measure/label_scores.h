#pragma once

#include <optional>
#include <vector>

#include "engine/measure/surface_scores.h"
#include "engine/volume/compare.h"

namespace palpate {

struct LabelScoresOptions {
    double tolerance_mm = 1.0;   // of the surface Dice; >= 0
    double box_margin_mm = 20.0; // by which the truth's box is larger on every side; >= 0
};

// How well samples A agree with the truth B; all but RVD are shares. A score without a value is not
// defined: its denominator is 0.
//
// Two empty sets agree: Dice and Jaccard are 1, VOE and RVD 0.
struct OverlapScores {
    uint64_t first = 0, second = 0, both = 0; // samples of A, of B, of A and B
    uint64_t frame = 0;                       // samples of the whole map
    uint64_t box = 0, first_in_box = 0;       // of B's box with its margin, and of A in it

    double dice() const;                           // 2 |A and B| / (|A| + |B|)
    double jaccard() const;                        // |A and B| / |A or B|
    double voe() const { return 1.0 - jaccard(); } // volume overlap error
    std::optional<double> rvd() const;             // (|A| - |B|) / |B|; not defined: B empty, A not
    std::optional<double> sensitivity() const;     // |A and B| / |B|
    std::optional<double> ppv() const;             // |A and B| / |A|
    std::optional<double> specificity() const;     // true negatives / all outside B, of the frame
    std::optional<double> box_specificity() const; // the same in the box; not defined: B empty
};

struct LabelScores {
    uint32_t label = 0; // 0: all labels together
    OverlapScores overlap;
    std::optional<SurfaceScores> surface; // not defined on a sheared grid
};

struct LabelMapScores {
    LabelScores overall;             // counts are sums over the labels, surfaces all their pieces
    std::vector<LabelScores> labels; // each that either map has, rising, 0 apart
};

// Scores of a label map against the truth, on one grid: the second's counts. Refused: sizes that
// differ, values that are no labels.
Result<LabelMapScores> label_scores(const Volume& first, const Volume& truth,
                                    const LabelScoresOptions& options, const Task& task);

// How well runs of one method agree on one label (Nystroem et al. 2008 call the mean Jaccard their
// precision), and how much its volume varies.
struct RunsAgreement {
    uint32_t label = 0;
    size_t runs = 0;
    double jaccard_mean = 0.0, jaccard_least = 0.0; // over all pairs of runs
    std::optional<double> jaccard_cv;               // sd / mean, sd with pairs - 1; 3 runs or more
    double volume_mean_mm3 = 0.0;
    std::optional<double> volume_cv; // not defined: no run has the label
};
// Compares two runs or more, for each label that any of them has, rising.
Result<std::vector<RunsAgreement>> runs_agreement(const std::vector<Volume>& runs);

} // namespace palpate
