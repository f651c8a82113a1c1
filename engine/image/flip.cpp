#include "engine/image/flip.h"

#include <array>
#include <cmath>
#include <numbers>

#include "engine/base/assert.h"

namespace palpate {

namespace {

constexpr double kPi = std::numbers::pi;

// Weights of the paper: exponents, and the remap that sends errors below kColorKnee of the largest
// to kColorShare of the range.
constexpr double kColorExponent = 0.7;    // q_c
constexpr double kColorKnee = 0.4;        // p_c
constexpr double kColorShare = 0.95;      // p_t
constexpr double kFeatureExponent = 0.5;  // q_f
constexpr double kFeatureDegrees = 0.082; // width of an edge as the eye finds it, w

// One of the Gaussians whose sum is a contrast sensitivity function; `width` in degrees^2.
struct CsfTerm {
    double amplitude, width;
};
const std::array<std::vector<CsfTerm>, 3> kCsf{{
    {{1.0, 0.0047}},               // achromatic
    {{1.0, 0.0053}},               // red-green
    {{34.1, 0.04}, {13.5, 0.025}}, // blue-yellow
}};
constexpr double kWidestCsf = 0.04;

using Color = glm::dvec3;
struct Planes {
    glm::ivec2 size;
    std::vector<Color> colors;
};

// sRGB primaries and D65 white, IEC 61966-2-1. glm matrices are given column by column.
const glm::dmat3 kXyzFromRgb = glm::transpose(
    glm::dmat3(10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794,   // X
               2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897,     // Y
               1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382)); // Z
const glm::dmat3 kRgbFromXyz = glm::inverse(kXyzFromRgb);
const Color kWhite = kXyzFromRgb * Color(1.0);

double linear_from_srgb(double v) {
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

// The linear opponent space YyCxCz.
Color opponent_from_xyz(Color xyz) {
    const Color t = xyz / kWhite;
    return {116.0 * t.y - 16.0, 500.0 * (t.x - t.y), 200.0 * (t.y - t.z)};
}
Color xyz_from_opponent(Color c) {
    const double y = (c.x + 16.0) / 116.0;
    return kWhite * Color(y + c.y / 500.0, y, y - c.z / 200.0);
}

// CIELab with a* and b* scaled by lightness after Hunt.
Color hunt_lab_from_rgb(Color rgb) {
    Color t = kXyzFromRgb * rgb / kWhite;
    constexpr double kDelta = 6.0 / 29.0;
    for (int i = 0; i < 3; ++i)
        t[i] = t[i] > kDelta * kDelta * kDelta ? std::cbrt(t[i])
                                               : t[i] / (3.0 * kDelta * kDelta) + 4.0 / 29.0;
    const double lightness = 116.0 * t.y - 16.0;
    return {lightness, 0.01 * lightness * 500.0 * (t.x - t.y),
            0.01 * lightness * 200.0 * (t.y - t.z)};
}

double hyab(Color a, Color b) {
    return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z);
}

// Samples of a function at -radius .. radius pixels.
template <class Function>
std::vector<double> kernel(int radius, Function f) {
    std::vector<double> k;
    for (int x = -radius; x <= radius; ++x)
        k.push_back(f(x));
    return k;
}

double sum_of(const std::vector<double>& k) {
    double sum = 0.0;
    for (const double v : k)
        sum += v;
    return sum;
}

// Filters rows by kx, then columns by ky; borders repeat the last pixel.
std::vector<double> filter(const std::vector<double>& plane, glm::ivec2 size,
                           const std::vector<double>& kx, const std::vector<double>& ky) {
    const int radius = static_cast<int>(kx.size() / 2);
    std::vector<double> rows(plane.size()), out(plane.size());
    const auto at = [&](int x, int y) { return static_cast<size_t>(y) * size.x + x; };
    for (int y = 0; y < size.y; ++y)
        for (int x = 0; x < size.x; ++x)
            for (int i = -radius; i <= radius; ++i)
                rows[at(x, y)] += kx[i + radius] * plane[at(glm::clamp(x + i, 0, size.x - 1), y)];
    for (int y = 0; y < size.y; ++y)
        for (int i = -radius; i <= radius; ++i) {
            const int from = glm::clamp(y + i, 0, size.y - 1);
            for (int x = 0; x < size.x; ++x)
                out[at(x, y)] += ky[i + radius] * rows[at(x, from)];
        }
    return out;
}

std::vector<double> component(const Planes& planes, int c) {
    std::vector<double> out(planes.colors.size());
    for (size_t i = 0; i < out.size(); ++i)
        out[i] = planes.colors[i][c];
    return out;
}

// The channels as the eye resolves them: each opponent one filtered by its contrast sensitivity.
Planes filtered(const Planes& opponent, double pixels_per_degree) {
    const int radius = static_cast<int>(
        std::ceil(3.0 * std::sqrt(kWidestCsf / (2.0 * kPi * kPi)) * pixels_per_degree));
    Planes out{opponent.size, std::vector<Color>(opponent.colors.size(), Color(0.0))};
    for (int c = 0; c < 3; ++c) {
        const std::vector<double> plane = component(opponent, c);
        double total = 0.0;
        for (const CsfTerm& term : kCsf[c]) {
            const auto gaussian = kernel(radius, [&](int x) {
                const double degrees = x / pixels_per_degree;
                return std::exp(-kPi * kPi * degrees * degrees / term.width);
            });
            const double weight = term.amplitude * std::sqrt(kPi / term.width);
            total += weight * sum_of(gaussian) * sum_of(gaussian);
            const std::vector<double> part = filter(plane, opponent.size, gaussian, gaussian);
            for (size_t i = 0; i < part.size(); ++i)
                out.colors[i][c] += weight * part[i];
        }
        for (Color& color : out.colors)
            color[c] /= total;
    }
    return out;
}

double largest_color_error() {
    static const double error =
        std::pow(hyab(hunt_lab_from_rgb({0, 1, 0}), hunt_lab_from_rgb({0, 0, 1})), kColorExponent);
    return error;
}

std::vector<Color> seen_colors(const Planes& opponent, double pixels_per_degree) {
    Planes planes = filtered(opponent, pixels_per_degree);
    for (Color& color : planes.colors)
        color = hunt_lab_from_rgb(
            glm::clamp(kRgbFromXyz * xyz_from_opponent(color), Color(0.0), Color(1.0)));
    return planes.colors;
}

double color_error(Color a, Color b) {
    const double error = std::pow(hyab(a, b), kColorExponent);
    const double knee = kColorKnee * largest_color_error();
    if (error < knee)
        return kColorShare * error / knee;
    return kColorShare + (1.0 - kColorShare) * (error - knee) / (largest_color_error() - knee);
}

// Strength of edges (x) and of points (y) in the achromatic channel.
std::vector<glm::dvec2> features(const Planes& opponent, double pixels_per_degree) {
    std::vector<double> luminance = component(opponent, 0);
    for (double& v : luminance)
        v = (v + 16.0) / 116.0;
    const double sigma = 0.5 * kFeatureDegrees * pixels_per_degree;
    const int radius = static_cast<int>(std::ceil(3.0 * sigma));
    const auto gaussian = [&](int x) { return std::exp(-x * x / (2.0 * sigma * sigma)); };
    std::vector<double> across = kernel(radius, gaussian);
    std::vector<double> edge = kernel(radius, [&](int x) { return -x * gaussian(x); });
    std::vector<double> point =
        kernel(radius, [&](int x) { return (x * x / (sigma * sigma) - 1.0) * gaussian(x); });
    const double sum = sum_of(across);
    for (double& v : across)
        v /= sum;
    // The positive weights of a detector sum to 1, the negative ones to -1.
    for (std::vector<double>* k : {&edge, &point}) {
        double positive = 0.0, negative = 0.0;
        for (const double v : *k)
            (v > 0.0 ? positive : negative) += std::abs(v);
        for (double& v : *k)
            v /= v > 0.0 ? positive : negative;
    }
    std::vector<glm::dvec2> out(luminance.size());
    const glm::ivec2 size = opponent.size;
    for (int kind = 0; kind < 2; ++kind) {
        const std::vector<double>& along = kind == 0 ? edge : point;
        const std::vector<double> dx = filter(luminance, size, along, across);
        const std::vector<double> dy = filter(luminance, size, across, along);
        for (size_t i = 0; i < out.size(); ++i)
            out[i][kind] = std::hypot(dx[i], dy[i]);
    }
    return out;
}

std::optional<Planes> opponent_planes(const Image& image) {
    std::array<size_t, 3> from{};
    for (size_t c = 0; c < 3; ++c) {
        auto index = channel_index(image, std::string_view("RGB").substr(c, 1));
        if (!index)
            index = channel_index(image, "Y");
        if (!index)
            return std::nullopt;
        from[c] = *index;
    }
    Planes planes{glm::ivec2(image.size_px), {}};
    planes.colors.reserve(size_t{image.size_px.x} * image.size_px.y);
    for (size_t first = 0; first < image.samples.size(); first += image.channels.size()) {
        Color rgb;
        for (size_t c = 0; c < 3; ++c) {
            const double v = image.samples[first + from[c]];
            rgb[static_cast<int>(c)] = v > 0.0 ? linear_from_srgb(std::min(v, 1.0)) : 0.0;
        }
        planes.colors.push_back(opponent_from_xyz(kXyzFromRgb * rgb));
    }
    return planes;
}

} // namespace

std::optional<std::vector<double>> flip_map(const Image& reference, const Image& test,
                                            double pixels_per_degree) {
    PALPATE_ASSERT(reference.size_px == test.size_px);
    PALPATE_ASSERT_CMP(pixels_per_degree, >, 0.0);
    const std::optional<Planes> a = opponent_planes(reference);
    const std::optional<Planes> b = opponent_planes(test);
    if (!a || !b)
        return std::nullopt;
    const std::vector<Color> colors_a = seen_colors(*a, pixels_per_degree);
    const std::vector<Color> colors_b = seen_colors(*b, pixels_per_degree);
    const std::vector<glm::dvec2> features_a = features(*a, pixels_per_degree);
    const std::vector<glm::dvec2> features_b = features(*b, pixels_per_degree);
    std::vector<double> map(colors_a.size());
    for (size_t i = 0; i < map.size(); ++i) {
        const glm::dvec2 change = glm::abs(features_a[i] - features_b[i]);
        const double feature =
            std::pow(std::max(change.x, change.y) / std::numbers::sqrt2, kFeatureExponent);
        map[i] = std::pow(color_error(colors_a[i], colors_b[i]), 1.0 - feature);
    }
    return map;
}

} // namespace palpate
