// Thresholds between classes of values (Otsu 1979), exact for a histogram of any number of classes.

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "engine/segment/method_parts.h"
#include "engine/segment/method_runs.h"

namespace palpate {

namespace {

constexpr size_t kMostBins = 4096;

// Samples by value, in bins of one width. Whole values of up to kMostBins have a bin each.
struct Counts {
    double low, width; // of the first bin
    std::vector<uint64_t> samples;

    double edge(size_t bin) const { return low + width * double(bin); }
};

Counts empty_counts(const Volume& volume) {
    const ValueRange range = volume.range();
    const double span = double{range.max} - range.min;
    const bool is_whole = volume.type() != ScalarType::f32 && span < double(kMostBins);
    const double width = is_whole ? 1.0 : span / double(kMostBins - 1);
    const auto bins = static_cast<size_t>(std::lround(span / width)) + 1;
    return {range.min - 0.5 * width, width, std::vector<uint64_t>(bins)};
}

// False if it was stopped.
bool count(const Volume& volume, const Task& task, Counts& counts) {
    const glm::uvec3 bricks = volume.brick_count();
    std::mutex mutex;
    return run_all(size_t{bricks.x} * bricks.y * bricks.z, task, [&](size_t i) {
        const glm::uvec3 at(i % bricks.x, i / bricks.x % bricks.y,
                            i / (size_t{bricks.x} * bricks.y));
        const Brick& brick = volume.brick(at);
        const Brick::Pinned pinned = brick.pin();
        const glm::uvec3 valid = volume.valid_in_brick(at);
        std::vector<uint32_t> own(counts.samples.size());
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x) {
                    const float value = brick.value(pinned, offset_in_brick({x, y, z}));
                    if (std::isnan(value))
                        continue;
                    const double place = (double{value} - counts.low) / counts.width;
                    ++own[std::min(static_cast<size_t>(place), own.size() - 1)];
                }
        const std::lock_guard lock(mutex); // sums of whole numbers: any order gives the same
        for (size_t bin = 0; bin < own.size(); ++bin)
            counts.samples[bin] += own[bin];
    });
}

// The first bins of all classes but the lowest, for which the variance between the classes is
// largest: the sum over classes of (sum of values)^2 / samples. By dynamic programming over the
// bins that hold samples.
std::vector<size_t> first_bins(const Counts& counts, size_t classes) {
    std::vector<size_t> bins;                      // that hold samples
    std::vector<double> samples{0.0}, values{0.0}; // up to each of them, the value from the middle
    const double middle = 0.5 * double(counts.samples.size());
    for (size_t bin = 0; bin < counts.samples.size(); ++bin)
        if (const auto n = double(counts.samples[bin]); n > 0.0) {
            bins.push_back(bin);
            samples.push_back(samples.back() + n);
            values.push_back(values.back() + n * (double(bin) - middle));
        }
    const size_t count = bins.size();
    const auto part = [&](size_t from, size_t to) { // of the bins from .. to - 1
        const double sum = values[to] - values[from];
        return sum * sum / (samples[to] - samples[from]);
    };
    // best[k][to]: of the first `to` bins in k + 1 classes; cut[k][to]: where its last class
    // begins.
    std::vector best(classes, std::vector<double>(count + 1, -1.0));
    std::vector cut(classes, std::vector<size_t>(count + 1, 0));
    for (size_t to = 1; to <= count; ++to)
        best[0][to] = part(0, to);
    for (size_t k = 1; k < classes; ++k)
        for (size_t to = k + 1; to <= count; ++to)
            for (size_t from = k; from < to; ++from)
                if (const double sum = best[k - 1][from] + part(from, to); sum > best[k][to]) {
                    best[k][to] = sum;
                    cut[k][to] = from;
                }
    std::vector<size_t> firsts;
    for (size_t k = classes - 1, to = count; k > 0; --k) {
        to = cut[k][to];
        firsts.insert(firsts.begin(), bins[to]);
    }
    return firsts;
}

} // namespace

Result<Segmented> run_otsu(const SegmentInput& input, const ParameterValues& values,
                           const Task& task) {
    const double asked = value_of(values, "classes");
    if (asked != std::floor(asked))
        return fail("otsu: classes: expected a whole number, found {:g}", asked);
    std::vector<double> thresholds;
    if (const ValueRange range = input.volume.range(); !range.empty() && range.min < range.max) {
        Counts counts = empty_counts(input.volume);
        if (!count(input.volume, task.part(0.0, 0.5), counts))
            return stopped();
        const auto different = static_cast<size_t>(std::count_if(
            counts.samples.begin(), counts.samples.end(), [](uint64_t n) { return n > 0; }));
        const size_t classes = std::min(static_cast<size_t>(asked), different);
        for (const size_t bin : first_bins(counts, classes))
            thresholds.push_back(counts.edge(bin));
    }
    PALPATE_TRY(Volume labels,
                map_values<uint8_t>(std::array{&input.volume}, task.part(0.5, 1.0), [&](auto v) {
                    uint8_t label = 0; // also of no data
                    for (const double threshold : thresholds)
                        label += v[0] >= threshold;
                    return label;
                }));
    Segmented made{std::move(labels), {}, {}, {}};
    made.notes.push_back(thresholds.empty() ? "all samples have one value, so there are no classes"
                                            : fmt::format("labels begin at the values {:g}",
                                                          fmt::join(thresholds, ", ")));
    return made;
}

} // namespace palpate
