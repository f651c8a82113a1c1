#include "engine/image/compare.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "engine/base/assert.h"

namespace palpate {

namespace {

// second - first, 0 for like NaN and infinities, nothing where no difference can be measured.
std::optional<double> difference_of(float first, float second) {
    if (first == second || (std::isnan(first) && std::isnan(second)))
        return 0.0;
    if (!std::isfinite(first) || !std::isfinite(second))
        return std::nullopt;
    return double{second} - double{first};
}

bool within(float first, float second, double bound) {
    const std::optional<double> difference = difference_of(first, second);
    return difference && std::abs(*difference) <= bound;
}

// For each channel of `first`, where `second` keeps it.
Result<std::vector<size_t>> matching_channels(const Image& first, const Image& second) {
    std::vector<size_t> matching;
    for (const std::string& name : first.channels)
        if (const auto index = channel_index(second, name))
            matching.push_back(*index);
    if (first.size_px != second.size_px)
        return fail("the pictures differ in size: {} x {} and {} x {} pixels", first.size_px.x,
                    first.size_px.y, second.size_px.x, second.size_px.y);
    if (matching.size() != first.channels.size() || matching.size() != second.channels.size())
        return fail("the pictures differ in channels: {} and {}", fmt::join(first.channels, ","),
                    fmt::join(second.channels, ","));
    return matching;
}

// Gathers the samples of the channels in `from`; `to` says where the second image keeps them.
SampleDifference measure(const Image& first, const Image& second, const std::vector<size_t>& from,
                         const std::vector<size_t>& to, double bound, std::string name) {
    SampleDifference out;
    out.channel = std::move(name);
    const size_t stride = first.channels.size();
    double sum = 0.0, squares = 0.0;
    uint64_t measured = 0;
    for (size_t pixel = 0; pixel < first.samples.size(); pixel += stride) {
        bool beyond = false;
        for (const size_t channel : from) {
            const std::optional<double> difference =
                difference_of(first.samples[pixel + channel], second.samples[pixel + to[channel]]);
            beyond = beyond || !difference || std::abs(*difference) > bound;
            if (!difference) {
                ++out.nan_mismatch;
                continue;
            }
            ++measured;
            sum += *difference;
            squares += *difference * *difference;
            out.max_abs = std::max(out.max_abs, std::abs(*difference));
        }
        out.beyond += beyond;
    }
    if (measured > 0) {
        out.rmse = std::sqrt(squares / static_cast<double>(measured));
        out.mean_signed = sum / static_cast<double>(measured);
    }
    const size_t pixels = first.samples.size() / stride;
    out.share_beyond =
        pixels > 0 ? static_cast<double>(out.beyond) / static_cast<double>(pixels) : 0.0;
    return out;
}

// Does pixel (x, y) of `a` meet its like in the 3x3 window of `b`? to[c] is b's place of channel c.
bool meets_its_like(const Image& a, const Image& b, const std::vector<size_t>& to, uint32_t x,
                    uint32_t y, double bound) {
    for (uint32_t v = y - (y > 0); v <= std::min(y + 1, a.size_px.y - 1); ++v)
        for (uint32_t u = x - (x > 0); u <= std::min(x + 1, a.size_px.x - 1); ++u) {
            bool like = true;
            for (size_t c = 0; c < to.size() && like; ++c)
                like = within(a.at(x, y, c), b.at(u, v, to[c]), bound);
            if (like)
                return true;
        }
    return false;
}

double neighborhood_match_share(const Image& first, const Image& second,
                                const std::vector<size_t>& to, double bound) {
    std::vector<size_t> back(to.size());
    for (size_t c = 0; c < to.size(); ++c)
        back[to[c]] = c;
    uint64_t matched = 0;
    for (uint32_t y = 0; y < first.size_px.y; ++y)
        for (uint32_t x = 0; x < first.size_px.x; ++x)
            matched += meets_its_like(first, second, to, x, y, bound) &&
                       meets_its_like(second, first, back, x, y, bound);
    const uint64_t pixels = uint64_t{first.size_px.x} * first.size_px.y;
    return pixels > 0 ? static_cast<double>(matched) / static_cast<double>(pixels) : 1.0;
}

} // namespace

Result<ImageDifference> compare_images(const Image& first, const Image& second, double bound,
                                       double pixels_per_degree) {
    if (!(bound >= 0.0))
        return fail("expected a bound of 0 or more, found {}", bound);
    PALPATE_TRY(const std::vector<size_t> matching, matching_channels(first, second));
    ImageDifference out;
    std::vector<size_t> every;
    for (size_t c = 0; c < first.channels.size(); ++c) {
        every.push_back(c);
        out.channels.push_back(measure(first, second, {c}, matching, bound, first.channels[c]));
    }
    out.all = measure(first, second, every, matching, bound, "all");
    const auto red = channel_index(first, "R"), green = channel_index(first, "G"),
               blue = channel_index(first, "B");
    if (red && green && blue)
        out.rgb = measure(first, second, {*red, *green, *blue}, matching, bound, "RGB");
    out.neighborhood_match_share = neighborhood_match_share(first, second, matching, bound);
    if (const auto map = flip_map(first, second, pixels_per_degree); map && !map->empty()) {
        double sum = 0.0;
        for (const double v : *map)
            sum += v;
        out.flip_mean = sum / static_cast<double>(map->size());
    }
    return out;
}

double color_rmse(const Image& first, const Image& second) {
    PALPATE_ASSERT(first.size_px == second.size_px);
    double sum = 0.0;
    for (uint32_t y = 0; y < first.size_px.y; ++y)
        for (uint32_t x = 0; x < first.size_px.x; ++x)
            for (size_t c = 0; c < 3; ++c) {
                const double difference = second.at(x, y, c) - first.at(x, y, c);
                sum += difference * difference;
            }
    return std::sqrt(sum / (3.0 * first.size_px.x * first.size_px.y));
}

Image difference_image(const Image& first, const Image& second, float gain) {
    const Result<std::vector<size_t>> matching = matching_channels(first, second);
    PALPATE_ASSERT(matching.has_value());
    Image out = make_image(first.size_px, first.channels);
    const size_t stride = first.channels.size();
    for (size_t i = 0; i < out.samples.size(); ++i) {
        const size_t channel = i % stride;
        const auto difference =
            difference_of(first.samples[i], second.samples[i - channel + (*matching)[channel]]);
        out.samples[i] = first.channels[channel] == "A" || !difference
                             ? 1.0f
                             : gain * static_cast<float>(std::abs(*difference));
    }
    return out;
}

} // namespace palpate
