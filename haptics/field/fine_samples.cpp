#include "haptics/field/fine_samples.h"

#include <algorithm>
#include <cstring>

#include "engine/base/assert.h"
#include "engine/base/clones.h"
#include "engine/volume/cubic_weights.h"
#include "haptics/field/samples.h"

namespace palpate::haptics {

namespace {

int floor_div(int a, int b) {
    return a >= 0 ? a / b : -((b - 1 - a) / b);
}

// The taps of a point: which they are, and where they begin among what was read.
struct Tapped {
    int start;
    const float* taps;
};

// out[o][i][r] = sum over k of taps_i[k] * in[o][start_i + k][r], for r < run; run >= 8. The last
// eight of a run overlap those before.
PALPATE_CLONES void convolve(const float* in, int read, int run, int outer, const Tapped* tapped,
                             int count, int tap_count, float* out) {
    using Eight = float __attribute__((vector_size(32)));
    for (int o = 0; o < outer; ++o)
        for (int i = 0; i < count; ++i) {
            const float* source = in + run * (read * o + tapped[i].start);
            float* target = out + run * (count * o + i);
            for (int r = 0;; r = std::min(r + 8, run - 8)) {
                Eight row;
                std::memcpy(&row, source + r, sizeof row);
                Eight total = tapped[i].taps[0] * row;
                for (int k = 1; k < tap_count; ++k) {
                    std::memcpy(&row, source + r + k * run, sizeof row);
                    total += tapped[i].taps[k] * row;
                }
                std::memcpy(target + r, &total, sizeof total);
                if (r == run - 8)
                    break;
            }
        }
}

bool has_same_grid(const Grid& a, const Grid& b) {
    return a.size == b.size && a.world_from_index == b.world_from_index;
}

} // namespace

FineSamples::FineSamples(int finer) : finer_(finer) {
    PALPATE_ASSERT(finer >= 1 && finer <= kMostFiner);
    constexpr size_t kRead = kMostRead, kSide = kMostSide;
    samples_.resize(kRead * kRead * kRead);
    z_.resize(kSide * kRead * kRead);
    zy_.resize(kSide * kSide * kRead);
    turned_.resize(kSide * kSide * kRead);
    sharp_.resize(kSide * kSide * kSide);
    smooth_.resize(kSide * kSide * kSide);
}

FineSamples::View FineSamples::make_view(const Filter& filter) const {
    View view{.reach = filter.reach};
    for (size_t axis = 0; axis < 3; ++axis)
        for (int phase = 0; phase < finer_; ++phase) {
            const auto spline = cubic_weights(double(phase) / finer_).value;
            std::array<double, kMostTaps> taps{};
            for (size_t s = 0; s < 4; ++s)
                for (size_t k = 0; k < size_t(2 * filter.reach + 1); ++k)
                    taps[s + k] += spline[s] * double{filter.taps[axis][k]};
            std::transform(taps.begin(), taps.end(), view.taps[axis][size_t(phase)].begin(),
                           [](double tap) { return static_cast<float>(tap); });
        }
    return view;
}

void FineSamples::follow(const Volume& volume, const TouchParameters& p) {
    volume_ = &volume;
    const bool labels = p.source == TouchSource::labels;
    const bool has_table = !labels && p.opacity.point_count > 0;
    const double iso = labels ? 0.5 : p.iso, blur = labels ? 1.0 : p.normal_blur_samples,
                 edge = p.edge_samples;
    const ValueRange range = volume.range();
    const float lowest =
        labels || range.empty() ? 0.0f : std::min(range.min, static_cast<float>(iso) - 1.0f);
    if (settings_ != 0 && labels == labels_ && has_table == has_table_ && iso == iso_ &&
        blur == blur_ && edge == edge_ && lowest == lowest_ &&
        (!has_table || p.opacity == table_) && has_same_grid(volume.grid(), grid_))
        return;
    ++settings_;
    labels_ = labels;
    has_table_ = has_table;
    iso_ = iso;
    blur_ = blur;
    edge_ = edge;
    lowest_ = lowest;
    table_ = p.opacity;
    grid_ = volume.grid();
    stored_.set(labels, iso);
    threshold_ = labels ? 0.0f : stored_.of(static_cast<float>(iso));
    free_value_ =
        stored_.of(has_table ? static_cast<float>(strength_n(table_, double{lowest})) : lowest);
    filters_ = make_filters(grid_, blur, edge, labels);
    sharp_view_ = make_view(filters_.sharp);
    smooth_view_ = make_view(filters_.smooth);
}

bool FineSamples::make(const View& view, glm::ivec3 first, int side, std::vector<float>& out) {
    PALPATE_ASSERT(volume_ && side >= 8 && side <= kMostSide);
    // Samples on each axis, the same number wherever `first` lies between two of them.
    const int tap_count = 2 * view.reach + 4;
    const int read = (side - 2 + finer_) / finer_ + tap_count;
    glm::ivec3 start;
    std::array<std::array<Tapped, kMostSide>, 3> tapped;
    for (int axis = 0; axis < 3; ++axis) {
        const int low = floor_div(first[axis], finer_);
        start[axis] = low - 1 - view.reach;
        for (int i = 0; i < side; ++i) {
            const int cell = floor_div(first[axis] + i, finer_);
            const auto phase = static_cast<size_t>(first[axis] + i - finer_ * cell);
            tapped[size_t(axis)][size_t(i)] = {cell - low, view.taps[size_t(axis)][phase].data()};
        }
    }
    const size_t count = size_t(read) * size_t(read) * size_t(read);
    const bool lacks = copy_resident(*volume_, start, glm::ivec3(read), lowest_, samples_.data());
    if (has_table_)
        for (size_t i = 0; i < count; ++i)
            samples_[i] = static_cast<float>(strength_n(table_, double{samples_[i]}));
    stored_.make({samples_.data(), count});
    convolve(samples_.data(), read, read * read, 1, tapped[2].data(), side, tap_count, z_.data());
    convolve(z_.data(), read, read, side, tapped[1].data(), side, tap_count, zy_.data());
    // Along x with y fastest, so that a run is long enough.
    for (int z = 0; z < side; ++z)
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < read; ++x)
                turned_[size_t(y + side * (x + read * z))] = zy_[size_t(x + read * (y + side * z))];
    convolve(turned_.data(), read, side, side, tapped[0].data(), side, tap_count, zy_.data());
    for (int z = 0; z < side; ++z)
        for (int y = 0; y < side; ++y)
            for (int x = 0; x < side; ++x)
                out[size_t(x + side * (y + side * z))] = zy_[size_t(y + side * (x + side * z))];
    return lacks;
}

FineSamples::Box FineSamples::sharp(glm::ivec3 first, int side) {
    const bool lacks = make(sharp_view_, first, side, sharp_);
    return {sharp_.data(), lacks};
}

FineSamples::Box FineSamples::smooth(glm::ivec3 first, int side) {
    const bool lacks = make(smooth_view_, first, side, smooth_);
    return {smooth_.data(), lacks};
}

bool FineSamples::is_free(glm::ivec3 sample) const {
    const float value = resident_sample(*volume_, sample);
    if (value != value)
        return true;
    return stored_.of(has_table_ ? static_cast<float>(strength_n(table_, double{value})) : value) <
           threshold_;
}

bool FineSamples::lacks_data(glm::dvec3 index) const {
    const int reach = std::max(sharp_view_.reach, smooth_view_.reach) + 1; // and a cell's corners
    const glm::ivec3 cell(glm::floor(glm::clamp(index, -1e6, 1e6)));
    return haptics::lacks_data(*volume_, cell - 1 - reach, cell + 2 + reach);
}

FineSamples::Matter FineSamples::matter(glm::ivec3 low, glm::ivec3 high) const {
    if (has_table_) // what is high need not be solid
        return Matter::unknown;
    for (int axis = 0; axis < 3; ++axis) {
        low[axis] = floor_div(low[axis], finer_) - 1 - sharp_view_.reach;
        high[axis] = floor_div(high[axis], finer_) + 2 + sharp_view_.reach;
    }
    bool lacks_some = false;
    const ValueRange range = range_about(*volume_, low, high, lacks_some);
    if (range.empty())
        return Matter::free;
    const auto highest = double{stored_.of(range.max)};
    const auto lowest = double{stored_.of(lacks_some ? std::min(range.min, lowest_) : range.min)};
    // Blurred labels stay within their samples' range, and rounding is less than a thousandth of
    // it.
    const double beyond = (labels_ ? 1e-3 : filters_.overshoot + 1e-3) * (highest - lowest);
    if (highest + beyond < double{threshold_})
        return Matter::free;
    return lowest - beyond > double{threshold_} ? Matter::solid : Matter::unknown;
}

} // namespace palpate::haptics
