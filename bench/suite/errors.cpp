#include "bench/suite/errors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "engine/base/assert.h"
#include "engine/base/percentile.h"
#include "engine/image/flip.h"

namespace palpate::bench {

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

size_t channel(const Image& image, const char* name) {
    const auto found = channel_index(image, name);
    PALPATE_ASSERT(found.has_value());
    return *found;
}

double surface_error(const Image& picture, const Image& truth, uint32_t x, uint32_t y,
                     double sample_mm) {
    const double there = truth.at(x, y, channel(truth, "depth"));
    const auto depth = channel_index(picture, "depth");
    const double here = depth ? double{picture.at(x, y, *depth)}
                              : (picture.at(x, y, channel(picture, "hit")) > 0.5f ? there : kNone);
    const bool hit = !depth ? picture.at(x, y, channel(picture, "hit")) > 0.5f : !std::isnan(here);
    if (!hit && std::isnan(there))
        return kNone;
    if (hit == std::isnan(there))
        return 1.0;
    return std::min(1.0, std::abs(here - there) / sample_mm);
}

// Every difference that is taken, with its sign, pixel by pixel.
template <class Visit>
void for_each_difference(const Image& picture, const Image& truth, Metric metric, double sample_mm,
                         const Visit& visit) {
    PALPATE_ASSERT(picture.size_px == truth.size_px);
    for (uint32_t y = 0; y < truth.size_px.y; ++y)
        for (uint32_t x = 0; x < truth.size_px.x; ++x) {
            if (metric == Metric::surface) {
                visit(x, y, surface_error(picture, truth, x, y, sample_mm));
                continue;
            }
            for (const char* name :
                 metric == Metric::color ? std::vector{"R", "G", "B"} : std::vector{"value"})
                visit(x, y,
                      double{picture.at(x, y, channel(picture, name))} -
                          double{truth.at(x, y, channel(truth, name))});
        }
}

} // namespace

Json Errors::json() const {
    Json v{
        {"unit", unit},  {"rmse", rmse}, {"max", max}, {"p999", p999}, {"mean_signed", mean_signed},
        {"count", count}};
    if (flip_mean >= 0)
        v["flip_mean"] = flip_mean;
    return v;
}

Errors errors_of(const Image& picture, const Image& truth, Metric metric, double sample_mm) {
    Errors errors;
    errors.unit = metric == Metric::color ? "colour" : metric == Metric::value ? "HU" : "samples";
    std::vector<double> sizes;
    double squares = 0, sum = 0;
    for_each_difference(picture, truth, metric, sample_mm, [&](uint32_t, uint32_t, double d) {
        if (std::isnan(d))
            return;
        sizes.push_back(std::abs(d));
        squares += d * d;
        sum += d;
    });
    errors.count = sizes.size();
    if (!sizes.empty()) {
        const auto n = static_cast<double>(sizes.size());
        errors.rmse = std::sqrt(squares / n);
        errors.mean_signed = metric == Metric::surface ? 0.0 : sum / n;
        errors.max = *std::max_element(sizes.begin(), sizes.end());
        errors.p999 = percentile(std::move(sizes), 0.999);
    }
    if (channel_index(picture, "R"))
        if (const auto map = flip_map(truth, picture); map && !map->empty())
            errors.flip_mean =
                std::accumulate(map->begin(), map->end(), 0.0) / static_cast<double>(map->size());
    return errors;
}

std::vector<double> difference_map(const Image& picture, const Image& truth, Metric metric,
                                   double sample_mm) {
    std::vector<double> map(size_t{truth.size_px.x} * truth.size_px.y, kNone);
    for_each_difference(picture, truth, metric, sample_mm, [&](uint32_t x, uint32_t y, double d) {
        double& most = map[size_t{y} * truth.size_px.x + x];
        if (!std::isnan(d) && !(most > std::abs(d)))
            most = std::abs(d);
    });
    return map;
}

} // namespace palpate::bench
