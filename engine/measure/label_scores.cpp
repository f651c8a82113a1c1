#include "engine/measure/label_scores.h"

#include <cmath>
#include <map>

#include "engine/measure/label_statistics.h"
#include "engine/segment/label_samples.h"
#include "engine/segment/signed_distance.h"

namespace palpate {

namespace {

std::optional<double> share(uint64_t part, uint64_t whole) {
    return whole > 0 ? std::optional(double(part) / double(whole)) : std::nullopt;
}

struct Box {
    glm::uvec3 low{UINT32_MAX}, high{0};

    void include(glm::uvec3 at) {
        low = glm::min(low, at);
        high = glm::max(high, at);
    }
    bool empty() const { return low.x > high.x; }
};

struct Found {
    OverlapScores overlap;
    Box first, second;
};

// visit(x, found) for every sample of a row that has a label.
template <class Visit>
void for_each_labelled(const std::vector<uint16_t>& row, std::map<uint16_t, Found>& found,
                       const Visit& visit) {
    Found* last = nullptr;
    for (uint32_t x = 0; x < row.size(); ++x) {
        if (row[x] == 0)
            continue;
        if (!last || row[x - 1] != row[x])
            last = &found[row[x]];
        visit(x, *last);
    }
}

std::map<uint16_t, Found> count(const Volume& first, const Volume& truth) {
    const glm::uvec3 size = first.size();
    std::map<uint16_t, Found> found;
    std::vector<uint16_t> a(size.x), b(size.x);
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y) {
            read_labels(first, {0, y, z}, {size.x, 1, 1}, a.data());
            read_labels(truth, {0, y, z}, {size.x, 1, 1}, b.data());
            for_each_labelled(a, found, [&](uint32_t x, Found& one) {
                ++one.overlap.first;
                one.overlap.both += a[x] == b[x];
                one.first.include({x, y, z});
            });
            for_each_labelled(b, found, [&](uint32_t x, Found& one) {
                ++one.overlap.second;
                one.second.include({x, y, z});
            });
        }
    return found;
}

// The truth's box with its margin, and what of A lies in it.
void count_in_box(const Volume& first, uint16_t label, const Box& truth, double margin_mm,
                  OverlapScores& out) {
    const glm::dvec3 margin = glm::ceil(margin_mm / spacing_mm(first.grid()));
    const glm::dvec3 last = glm::dvec3(first.size() - 1u);
    const glm::uvec3 low(glm::max(glm::dvec3(truth.low) - margin, glm::dvec3(0.0)));
    const glm::uvec3 high(glm::min(glm::dvec3(truth.high) + margin, last));
    const glm::uvec3 size = high - low + 1u;
    out.box = uint64_t{size.x} * size.y * size.z;
    std::vector<uint16_t> row(size.x);
    for (uint32_t z = low.z; z <= high.z; ++z)
        for (uint32_t y = low.y; y <= high.y; ++y) {
            read_labels(first, {low.x, y, z}, {size.x, 1, 1}, row.data());
            for (const uint16_t one : row)
                out.first_in_box += one == label;
        }
}

void add(OverlapScores& sum, const OverlapScores& one) {
    sum.first += one.first;
    sum.second += one.second;
    sum.both += one.both;
    sum.frame += one.frame;
    if (one.second == 0)
        return; // no box
    sum.box += one.box;
    sum.first_in_box += one.first_in_box;
}

struct Spread {
    double mean = 0.0, least = INFINITY;
    std::optional<double> cv;
};

Spread spread_of(const std::vector<double>& values) {
    Spread out;
    for (const double v : values) {
        out.mean += v / double(values.size());
        out.least = std::min(out.least, v);
    }
    double squares = 0.0;
    for (const double v : values)
        squares += (v - out.mean) * (v - out.mean);
    if (values.size() > 1 && out.mean > 0.0)
        out.cv = std::sqrt(squares / double(values.size() - 1)) / out.mean;
    return out;
}

Result<void> check_sizes(const Volume& a, const Volume& b) {
    const glm::uvec3 p = a.size(), q = b.size();
    if (p != q)
        return fail("the label maps differ in size: {} x {} x {} and {} x {} x {} voxels", p.x, p.y,
                    p.z, q.x, q.y, q.z);
    return {};
}

} // namespace

double OverlapScores::dice() const {
    return share(2 * both, first + second).value_or(1.0);
}
double OverlapScores::jaccard() const {
    return share(both, first + second - both).value_or(1.0);
}
std::optional<double> OverlapScores::rvd() const {
    if (first + second == 0)
        return 0.0;
    return second > 0 ? std::optional((double(first) - double(second)) / double(second))
                      : std::nullopt;
}
std::optional<double> OverlapScores::sensitivity() const {
    return share(both, second);
}
std::optional<double> OverlapScores::ppv() const {
    return share(both, first);
}
std::optional<double> OverlapScores::specificity() const {
    return share(frame - first - second + both, frame - second);
}
std::optional<double> OverlapScores::box_specificity() const {
    return box > 0 ? share(box - first_in_box - second + both, box - second) : std::nullopt;
}

Result<LabelMapScores> label_scores(const Volume& first, const Volume& truth,
                                    const LabelScoresOptions& options, const Task& task) {
    PALPATE_TRY(check_sizes(first, truth));
    PALPATE_TRY(check_labels(first, "the first label map"));
    PALPATE_TRY(check_labels(truth, "the second label map"));
    LabelMapScores out;
    const bool upright = check_perpendicular(first.grid(), "").has_value();
    std::map<uint16_t, Found> found = count(first, truth);
    SurfacePieces all;
    double done = 0.0;
    for (auto& [label, one] : found) {
        if (task.stop.stop_requested())
            return stopped();
        one.overlap.frame = sample_count(first.grid());
        if (!one.second.empty())
            count_in_box(first, label, one.second, options.box_margin_mm, one.overlap);
        add(out.overall.overlap, one.overlap);
        LabelScores& scores = out.labels.emplace_back(LabelScores{label, one.overlap, {}});
        const double from = done / double(found.size()), to = ++done / double(found.size());
        if (!upright)
            continue;
        PALPATE_TRY(SurfacePieces pieces,
                    surface_pieces(first, truth, label, glm::min(one.first.low, one.second.low),
                                   glm::max(one.first.high, one.second.high), task.part(from, to)));
        scores.surface = surface_scores(pieces, options.tolerance_mm);
        all.first.insert(all.first.end(), pieces.first.begin(), pieces.first.end());
        all.second.insert(all.second.end(), pieces.second.begin(), pieces.second.end());
    }
    if (upright)
        out.overall.surface = surface_scores(std::move(all), options.tolerance_mm);
    return out;
}

Result<std::vector<RunsAgreement>> runs_agreement(const std::vector<Volume>& runs) {
    for (const Volume& run : runs) {
        PALPATE_TRY(check_sizes(runs.front(), run));
        PALPATE_TRY(check_labels(run, "a label map of the runs"));
    }
    if (runs.size() < 2)
        return fail("expected two runs or more, found {}", runs.size());
    struct Values {
        std::vector<double> jaccard, volume;
    };
    std::map<uint32_t, Values> found;
    std::vector<std::vector<LabelAgreement>> pairs;
    for (size_t a = 0; a < runs.size(); ++a)
        for (size_t b = a + 1; b < runs.size(); ++b) {
            PALPATE_TRY(std::vector<LabelAgreement> pair, compare_labels(runs[a], runs[b]));
            for (const LabelAgreement& label : pair)
                found.try_emplace(label.label);
            pairs.push_back(std::move(pair));
        }
    for (auto& [label, values] : found) {
        values.volume.assign(runs.size(), 0.0);
        size_t n = 0;
        for (size_t a = 0; a < runs.size(); ++a)
            for (size_t b = a + 1; b < runs.size(); ++b) {
                LabelAgreement here{.label = label};
                for (const LabelAgreement& one : pairs[n])
                    if (one.label == label)
                        here = one;
                ++n;
                const bool none = here.first + here.second == 0;
                values.jaccard.push_back(none ? 1.0 : here.jaccard());
                const double mm3 = sample_mm3(runs[a].grid());
                values.volume[a] = mm3 * double(here.first);
                values.volume[b] = mm3 * double(here.second);
            }
    }
    std::vector<RunsAgreement> out;
    for (const auto& [label, values] : found) {
        const Spread jaccard = spread_of(values.jaccard), volume = spread_of(values.volume);
        out.push_back(
            {label, runs.size(), jaccard.mean, jaccard.least, jaccard.cv, volume.mean, volume.cv});
    }
    return out;
}

} // namespace palpate
