#pragma once

#include <functional>
#include <string>

#include "engine/measure/label_shape.h"
#include "engine/measure/label_statistics.h"
#include "engine/measure/measure.h"

namespace palpate {

struct MeasureReport {
    struct One {
        Measure measure;
        Measured measured;
    };
    struct Label {
        LabelStatistics statistics;
        LabelSurface surface;
        std::string name; // may be empty
    };
    std::vector<One> measures;
    std::vector<Label> labels;
    ValueRange histogram_range{}; // of the bins of all histograms
    std::string unit{};           // of the values, "HU"; empty: not known
};

// {"measures": [..], "labels": [..]}; what is not defined is left out of its entry.
Json report_json(const MeasureReport& report);

// A table (RFC 4180): a line of column names, one line a measure, one line a label. A field of what
// is not defined is empty; a column that no line fills is left out, and so is `no_data` where every
// sample has data. Names of columns end in their unit, if there is one: those of
// statistics in that of the values ("mean_HU"). Lengths in mm, areas in mm2, volumes in mm3 and ml.
// Points and centroids are LPS millimetres, axes unit vectors in LPS, low and high indices of
// samples. A measure without a name has that of its row.
std::string report_csv(const MeasureReport& report);

// "23.4 mm", "41.2°", "152 mm²", "14.1 ml": the first thing that a person wants to know.
std::string headline(const Measured& measured);
// "0.52 ml", "1234 ml"
std::string ml_text(double volume_mm3);

} // namespace palpate
