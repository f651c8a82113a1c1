#include "engine/decode/dicom_stack.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/option_name.h"
#include "engine/decode/dicom_copies.h"
#include "engine/decode/dicom_fit.h"
#include "engine/decode/dicom_places.h"
#include "engine/decode/frame_order.h"
#include "engine/decode/slice_gaps.h"

namespace palpate::io {

namespace {

// Lengths that differ from 1 by more, or cosines between axes, are no noise.
constexpr double kMostLength = 5e-3, kMostCosine = 0.0447; // 2.6 degrees
// Positions of images at one place differ by no more, nor by more of the distance between places.
constexpr double kMostNoiseMm = 0.1, kNoiseOfStep = 0.1;

bool are_unit_vectors_at_right_angles(const glm::dmat2x3& axes) {
    return std::abs(glm::length(axes[0]) - 1) <= kMostLength &&
           std::abs(glm::length(axes[1]) - 1) <= kMostLength &&
           std::abs(glm::dot(axes[0], axes[1])) <= kMostCosine;
}

double along_normal(const DicomFrame& frame, glm::dvec3 normal) {
    return glm::dot(*frame.position, normal);
}

bool are_even(const std::vector<std::vector<DicomFrame>>& places) {
    return std::all_of(places.begin(), places.end(),
                       [&](const auto& place) { return place.size() == places.front().size(); });
}

// How many images lie at each place, where their depths, which rise, differ by noise; else 1.
size_t images_at_each_place(const std::vector<double>& along_mm) {
    for (size_t each = 2; each <= along_mm.size() / 2; ++each) {
        if (along_mm.size() % each != 0)
            continue;
        double widest = 0, closest = std::numeric_limits<double>::max();
        for (size_t first = 0; first < along_mm.size(); first += each) {
            widest = std::max(widest, along_mm[first + each - 1] - along_mm[first]);
            if (first > 0)
                closest = std::min(closest, along_mm[first] - along_mm[first - 1]);
        }
        if (widest <= std::min(kMostNoiseMm, kNoiseOfStep * closest))
            return each;
    }
    return 1;
}

// Puts sorted images that lie at one place together.
std::vector<std::vector<DicomFrame>> group_places(const std::vector<DicomFrame>& frames,
                                                  glm::dvec3 normal) {
    std::vector<double> along_mm;
    std::vector<std::vector<DicomFrame>> places;
    for (const DicomFrame& frame : frames) {
        const double here = along_normal(frame, normal);
        if (places.empty() || here - along_mm.back() > kPositionRoundingMm)
            places.emplace_back();
        places.back().push_back(frame);
        along_mm.push_back(here);
    }
    if (are_even(places) && places.front().size() > 1)
        return places;
    const size_t each = images_at_each_place(along_mm);
    if (each == 1)
        return places;
    places.clear();
    for (auto first = frames.begin(); first != frames.end();
         first += static_cast<std::ptrdiff_t>(each))
        places.emplace_back(first, first + static_cast<std::ptrdiff_t>(each));
    return places;
}

// Several images at each position are frames of a 4-D series: keeps the one asked for.
Result<void> keep_frame(const DecodeRequest& request, glm::dvec3 normal,
                        const SameSamples& same_samples, DicomStack& stack) {
    const std::string name = request.path.string();
    std::vector<DicomFrame>& frames = stack.frames;
    std::vector<std::vector<DicomFrame>> places = group_places(frames, normal);
    const auto duplicates = [&]() -> Result<std::string> {
        const auto more =
            std::max_element(places.begin(), places.end(),
                             [](const auto& a, const auto& b) { return a.size() < b.size(); });
        return fail(
            "{}: duplicate positions: {} and {} lie both at {:.3f} mm along the "
            "normal, while other positions have another number of images",
            name, leaf((*more)[0]), leaf((*more)[1]), along_normal((*more)[0], normal));
    };
    if (!are_even(places) || places.front().size() > 1) {
        Result<std::string> order = are_even(places) ? order_frames(name, places) : duplicates();
        if (order)
            stack.notes.push_back(fmt::format("{}: frames are ordered by {}", name, *order));
        else if (!same_samples || !drop_equal_images(name, places, same_samples, stack.warnings))
            return pass_on(order);
    }
    const auto count = static_cast<uint32_t>(places.front().size());
    PALPATE_TRY(const uint32_t chosen, choose_frame(request, count, stack.warnings));
    frames.clear();
    for (auto& place : places)
        frames.push_back(std::move(place[chosen]));
    return {};
}

// An upright grid of even spacing that holds all images, for resampling.
Result<Grid> upright_grid(const std::string& name, const std::vector<DicomFrame>& frames,
                          const Places& places, glm::dmat2x3 axes, glm::dvec2 spacing,
                          std::vector<std::string>& warnings) {
    // No more slices or samples than these multiples, however odd the positions are.
    constexpr double kMostSlices = 8, kMostSideways = 4, kAlwaysSideways = 256;
    const double range = places.along_mm.back() - places.along_mm.front();
    const double wish = std::max(finest_spacing_mm(places.along_mm),
                                 range / (kMostSlices * static_cast<double>(frames.size())));
    const double steps = std::max(1.0, std::ceil(range / wish - 0.01));
    // The beginnings of images, in samples from where the first one begins.
    glm::dvec2 low(0), high(0);
    for (const DicomFrame& frame : frames) {
        const glm::dvec2 at = (*frame.position - *frames.front().position) * axes / spacing;
        low = glm::min(low, at);
        high = glm::max(high, at);
    }
    const glm::dvec2 first = glm::floor(low + 1e-3), last = glm::ceil(high - 1e-3);
    const glm::dvec2 more = last - first, size(frames.front().size);
    const glm::dvec2 most = glm::max(kMostSideways * size, glm::dvec2(kAlwaysSideways));
    if (more.x > most.x || more.y > most.y)
        return fail("{}: cannot be resampled: its slices lie up to {:.4g} mm apart sideways", name,
                    glm::length((high - low) * spacing));
    Grid grid;
    grid.size = {glm::uvec2(size + more), static_cast<uint32_t>(steps) + 1};
    const double step_mm = range / steps;
    grid.world_from_index = {glm::dvec4(axes[0] * spacing.x, 0.0),
                             glm::dvec4(axes[1] * spacing.y, 0.0),
                             glm::dvec4(places.normal * step_mm, 0.0),
                             glm::dvec4(*frames.front().position + axes * (first * spacing), 1.0)};
    std::string what = fmt::format(
        "{}: resampled ({}): {}; interpolated linearly to {} slices {:.4g} mm apart", name,
        Option{"resample-slices"}, gap_words(places.along_mm), grid.size.z, step_mm);
    if (places.sideways_mm > 10 * kPositionRoundingMm)
        what += fmt::format(
            "; gantry tilt of {:.2f} degrees removed, {} x {} samples a slice "
            "became {} x {} (no data where no image lies)",
            tilt_degrees(places), frames.front().size.x, frames.front().size.y, grid.size.x,
            grid.size.y);
    warnings.push_back(what);
    return grid;
}

void assume_what_is_absent(const std::string& name, const DicomFrame& first, size_t count,
                           std::vector<std::string>& warnings) {
    std::string absent;
    const auto add = [&](bool has, const char* what) {
        if (!has)
            absent += (absent.empty() ? "" : ", ") + std::string(what);
    };
    add(first.position.has_value(), "position (0, 0, 0 mm)");
    add(first.axes.has_value(), "orientation (axial)");
    add(first.spacing_mm.has_value(), "pixel spacing (1 mm)");
    add(first.slice_step_mm.has_value() || (count > 1 && first.position), "slice spacing (1 mm)");
    if (!absent.empty())
        warnings.push_back(
            fmt::format("{}: does not state, so what stands in brackets is assumed: "
                        "{}",
                        name, absent));
}

} // namespace

Result<DicomStack> make_stack(const DecodeRequest& request, DicomSeries series, size_t damaged,
                              const std::vector<DicomFrame>& left_out,
                              const SameSamples& same_samples) {
    const std::string name = request.path.string();
    DicomStack stack;
    std::vector<DicomFrame>& frames = stack.frames = std::move(series.frames);
    drop_copies(name, frames, stack.warnings);

    for (const DicomFrame& frame : frames)
        if (frame.axes && !are_unit_vectors_at_right_angles(*frame.axes))
            return fail("{}: the image axes of {} are no unit vectors at right angles", name,
                        leaf(frame));
    FittedPlane plane = fit_plane(frames);
    const double sign = frames.front().against_normal ? -1.0 : 1.0;
    glm::dvec3 normal = sign * glm::cross(plane.axes[0], plane.axes[1]);
    const bool placed = frames.front().position.has_value();
    std::stable_sort(frames.begin(), frames.end(), [&](const DicomFrame& a, const DicomFrame& b) {
        return placed ? along_normal(a, normal) < along_normal(b, normal)
                      : a.instance_number < b.instance_number;
    });
    if (placed) {
        PALPATE_TRY(keep_frame(request, normal, same_samples, stack));
    } else if (frames.size() > 1 && frames[0].file == frames[1].file) {
        // Frames of one file without places are frames in time.
        const auto count = static_cast<uint32_t>(frames.size());
        PALPATE_TRY(const uint32_t chosen, choose_frame(request, count, stack.warnings));
        frames = {frames[chosen]};
    }
    const DicomFrame first = frames.front();
    if (!first.spacing_words.empty())
        stack.warnings.push_back(fmt::format("{}: {}", name, first.spacing_words));
    assume_what_is_absent(name, first, frames.size(), stack.warnings);
    const glm::dvec2 spacing = plane.spacing_mm.value_or(glm::dvec2(1.0));
    glm::dvec3 origin = first.position.value_or(glm::dvec3(0.0));
    glm::dvec3 step = normal * first.slice_step_mm.value_or(1.0);
    if (placed && frames.size() > 1) {
        Places places = places_of(frames, normal);
        turn_to_line(plane, sign * places.step);
        normal = sign * glm::cross(plane.axes[0], plane.axes[1]);
        places = places_of(frames, normal);
        if (const std::string words = noise_words(frames, plane); !words.empty())
            stack.warnings.push_back(fmt::format("{}: {}", name, words));
        const double usual = glm::length(places.step);
        if (request.resample_slices &&
            (places.farthest_mm > std::max(kPositionRoundingMm, 0.01 * usual) ||
             places.sideways_mm > 10 * kPositionRoundingMm)) {
            PALPATE_TRY(stack.grid,
                        upright_grid(name, frames, places, plane.axes, spacing, stack.warnings));
            stack.resampled = true;
            return stack;
        }
        PALPATE_TRY(places,
                    regular_places(name, frames, normal, damaged, left_out, stack.warnings));
        origin = places.first;
        step = places.step;
    }
    if (request.resample_slices)
        stack.warnings.push_back(
            fmt::format("{}: {} has no effect: the slices are evenly spaced and "
                        "stacked along their normal",
                        name, Option{"resample-slices"}));
    stack.grid.size = {frames.front().size, frames.size()};
    stack.grid.world_from_index = {glm::dvec4(plane.axes[0] * spacing.x, 0.0),
                                   glm::dvec4(plane.axes[1] * spacing.y, 0.0),
                                   glm::dvec4(step, 0.0), glm::dvec4(origin, 1.0)};
    return stack;
}

} // namespace palpate::io
