#include "engine/decode/slice_gaps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/assert.h"
#include "engine/decode/dicom_stack.h"

namespace palpate::io {

namespace {

constexpr size_t kMostRunsInWords = 6;

bool agree(double a, double b) {
    return std::abs(a - b) <= std::max(kPositionRoundingMm, 0.01 * std::min(a, b));
}

} // namespace

std::vector<GapRun> gap_runs(const std::vector<double>& along_mm) {
    PALPATE_ASSERT_CMP(along_mm.size(), >=, size_t{2});
    std::vector<GapRun> runs;
    for (size_t k = 0; k + 1 < along_mm.size(); ++k) {
        const double gap = along_mm[k + 1] - along_mm[k];
        if (runs.empty() || !agree(gap, runs.back().gap_mm))
            runs.push_back({k, 0, 0});
        GapRun& run = runs.back();
        ++run.count;
        run.gap_mm = (along_mm[k + 1] - along_mm[run.first]) / static_cast<double>(run.count);
    }
    return runs;
}

std::string gap_words(const std::vector<double>& along_mm) {
    const std::vector<GapRun> runs = gap_runs(along_mm);
    if (runs.size() > kMostRunsInWords) {
        const auto [least, most] = std::minmax_element(
            runs.begin(), runs.end(),
            [](const GapRun& a, const GapRun& b) { return a.gap_mm < b.gap_mm; });
        return fmt::format("{} slices with gaps from {:.4g} to {:.4g} mm in {} runs",
                           along_mm.size(), least->gap_mm, most->gap_mm, runs.size());
    }
    std::string words;
    for (const GapRun& run : runs) {
        words += words.empty() ? "" : ", then ";
        if (run.count == 1)
            words += fmt::format("a gap of {:.4g} mm", run.gap_mm);
        else
            words +=
                fmt::format("{} slices {:.4g} mm apart (at {:.5g} .. {:.5g} mm)", run.count + 1,
                            run.gap_mm, along_mm[run.first], along_mm[run.first + run.count]);
    }
    return words;
}

std::vector<size_t> missing_before(const std::vector<double>& along_mm) {
    const std::vector<GapRun> runs = gap_runs(along_mm);
    // Runs of one gap lie apart where slices are missing between them.
    double usual = 0;
    size_t most = 0;
    for (const GapRun& run : runs) {
        size_t count = 0;
        for (const GapRun& other : runs)
            count += agree(run.gap_mm, other.gap_mm) ? other.count : 0;
        if (count > most || (count == most && run.gap_mm < usual)) {
            most = count;
            usual = run.gap_mm;
        }
    }
    std::vector<size_t> missing(along_mm.size(), 0);
    for (size_t k = 1; k < along_mm.size(); ++k) {
        const double multiple = (along_mm[k] - along_mm[k - 1]) / usual;
        if (!(multiple < 1e6) || std::abs(multiple - std::round(multiple)) > 0.05 ||
            std::round(multiple) < 1)
            return {};
        missing[k] = static_cast<size_t>(std::round(multiple)) - 1;
    }
    return missing;
}

double finest_spacing_mm(const std::vector<double>& along_mm) {
    double of_runs = 0, of_all = 0;
    for (const GapRun& run : gap_runs(along_mm)) {
        if (of_all == 0 || run.gap_mm < of_all)
            of_all = run.gap_mm;
        if (run.count >= 2 && (of_runs == 0 || run.gap_mm < of_runs))
            of_runs = run.gap_mm;
    }
    return of_runs > 0 ? of_runs : of_all;
}

} // namespace palpate::io
