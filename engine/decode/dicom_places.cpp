#include "engine/decode/dicom_places.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/base/option_name.h"
#include "engine/decode/dicom_fit.h"
#include "engine/decode/slice_gaps.h"

namespace palpate::io {

namespace {

// Beyond this share of the step, a slice put on the regular lattice would be in a wrong place;
// rounded positions are believed up to the second.
constexpr double kMostUneven = 0.1, kMostRounded = 0.25;
// The least-squares line of rounded points lies off the true one by a part of the rounding: the
// largest distance from it is 4/3 of the rounding for three points, and about as much for more.
constexpr double kOfRounding = 1.5;

bool is_regular(const Places& places) {
    return places.farthest_mm <= kMostUneven * glm::length(places.step) || places.within_rounding;
}

glm::dvec3 center_of(const DicomFrame& frame) {
    const glm::dmat2x3 axes = frame.axes.value_or(glm::dmat2x3{{1, 0, 0}, {0, 1, 0}});
    return *frame.position + axes * (frame.spacing_mm.value_or(glm::dvec2(1.0)) *
                                     (glm::dvec2(frame.size) - 1.0) * 0.5);
}

// A place without an image.
struct Hole {
    DicomFrame frame;                // as its neighbours are, without a file
    size_t before = 0;               // it lies between this image and the next
    const DicomFrame* out = nullptr; // the image that was left out and belongs here
};

std::vector<Hole> holes_of(const std::vector<DicomFrame>& frames,
                           const std::vector<size_t>& missing) {
    std::vector<Hole> holes;
    for (size_t k = 1; k < missing.size(); ++k)
        for (size_t i = 1; i <= missing[k]; ++i) {
            Hole& hole = holes.emplace_back(Hole{frames[k - 1], k - 1});
            const double share = static_cast<double>(i) / static_cast<double>(missing[k] + 1);
            hole.frame.position = glm::mix(*frames[k - 1].position, *frames[k].position, share);
            hole.frame.file.clear();
            hole.frame.rescale = {};
            hole.frame.padding = {};
        }
    return holes;
}

bool belongs(const DicomFrame& out, const Hole& hole, const std::vector<DicomFrame>& frames) {
    const DicomFrame &before = frames[hole.before], &after = frames[hole.before + 1];
    const double half_mm = 0.5 * glm::distance(*before.position, *hole.frame.position);
    if (out.position && (glm::distance(*out.position, *hole.frame.position) <= half_mm ||
                         glm::distance(center_of(out), center_of(hole.frame)) <= half_mm))
        return true;
    const int64_t up = after.instance_number - out.instance_number;
    return (up == 1 || up == -1) && out.instance_number - before.instance_number == up;
}

// Gives holes the images that belong there; returns how many.
size_t explain(std::vector<Hole>& holes, const std::vector<DicomFrame>& frames,
               const std::vector<DicomFrame>& left_out) {
    size_t explained = 0;
    for (const DicomFrame& out : left_out) {
        const auto found = std::find_if(holes.begin(), holes.end(), [&](const Hole& hole) {
            return !hole.out && belongs(out, hole, frames);
        });
        if (found != holes.end()) {
            found->out = &out;
            ++explained;
        }
    }
    return explained;
}

std::vector<DicomFrame> filled(const std::vector<DicomFrame>& frames,
                               const std::vector<Hole>& holes) {
    std::vector<DicomFrame> all;
    auto hole = holes.begin();
    for (size_t k = 0; k < frames.size(); ++k) {
        all.push_back(frames[k]);
        for (; hole != holes.end() && hole->before == k; ++hole)
            all.push_back(hole->frame);
    }
    return all;
}

std::string files_words(size_t damaged) {
    return fmt::format("{} damaged file{} passed over", damaged, damaged == 1 ? " was" : "s were");
}

void warn_of_holes(const std::string& name, const std::vector<Hole>& holes, size_t slices,
                   size_t damaged, const DicomFrame& other, std::vector<std::string>& warnings) {
    size_t lost = 0;
    for (const Hole& hole : holes) {
        lost += hole.out ? 0 : 1;
        if (hole.out)
            warnings.push_back(
                fmt::format("{}: {} has {} and is left out: its place in the stack holds no data",
                            name, leaf(*hole.out), difference_words(*hole.out, other)));
    }
    if (lost > 0)
        warnings.push_back(fmt::format("{}: {} of {} slices {} missing, as {}; {} no data", name,
                                       lost, slices, lost == 1 ? "is" : "are", files_words(damaged),
                                       lost == 1 ? "it holds" : "they hold"));
}

// Images that lie elsewhere than most say by position and number, in words; empty where there are
// none, or where the numbers rise with the positions all the same.
std::string misplaced_words(const std::vector<DicomFrame>& frames) {
    std::vector<const DicomFrame*> sorted;
    for (const DicomFrame& frame : frames)
        sorted.push_back(&frame);
    std::stable_sort(sorted.begin(), sorted.end(), [](const auto* a, const auto* b) {
        return a->instance_number < b->instance_number;
    });
    std::vector<glm::dvec3> points;
    std::vector<double> numbers;
    for (const DicomFrame* frame : sorted) {
        const auto number = static_cast<double>(frame->instance_number);
        if (!numbers.empty() && number <= numbers.back())
            return {};
        numbers.push_back(number);
        points.push_back(*frame->position);
    }
    // Pointers into `frames`, which are sorted by position.
    if (frames.size() < 4 || std::is_sorted(sorted.begin(), sorted.end()) ||
        std::is_sorted(sorted.rbegin(), sorted.rend()))
        return {};
    const FittedLine line = fit_line(points, numbers);
    const double most = 0.5 * glm::length(line.step);
    const auto off =
        std::count_if(line.off_mm.begin(), line.off_mm.end(), [&](double mm) { return mm > most; });
    if (off == 0 || static_cast<size_t>(off) > frames.size() / 4)
        return {};
    const size_t worst = static_cast<size_t>(
        std::max_element(line.off_mm.begin(), line.off_mm.end()) - line.off_mm.begin());
    return fmt::format(
        "{} (number {}) lies {:.4g} mm from the place that its number has among the "
        "others{}",
        leaf(*sorted[worst]), sorted[worst]->instance_number, line.off_mm[worst],
        off == 1 ? "" : fmt::format(", and {} more do so", off - 1));
}

// A few images that lie further from the rest than the rest are long, in words; else empty.
std::string far_words(const std::vector<DicomFrame>& frames, const Places& places, size_t gap) {
    const size_t below = gap + 1, above = frames.size() - below, few = std::min(below, above);
    const double gap_mm = places.along_mm[gap + 1] - places.along_mm[gap];
    const double rest_mm = above < below ? places.along_mm[gap] - places.along_mm.front()
                                         : places.along_mm.back() - places.along_mm[gap + 1];
    if (few > frames.size() / 4 || gap_mm <= rest_mm)
        return {};
    const DicomFrame& out = above < below ? frames[gap + 1] : frames[gap];
    return fmt::format("{}{} lies {:.4g} mm from the nearest of the other {} images", leaf(out),
                       few == 1 ? "" : fmt::format(", with {} more,", few - 1), gap_mm,
                       frames.size() - few);
}

// One image, or a few, off the line of the others, in words; else empty.
std::string outlier_words(const std::vector<DicomFrame>& frames, const Places& places) {
    const double most = kMostUneven * glm::length(places.step);
    const auto off = std::count_if(places.off_mm.begin(), places.off_mm.end(),
                                   [&](double mm) { return mm > most; });
    if (frames.size() < 4 || static_cast<size_t>(off) > frames.size() / 4)
        return {};
    const size_t worst = static_cast<size_t>(
        std::max_element(places.off_mm.begin(), places.off_mm.end()) - places.off_mm.begin());
    return fmt::format("{} lies {:.4g} mm from its place in the row of the others{}",
                       leaf(frames[worst]), places.off_mm[worst],
                       off == 1 ? "" : fmt::format(", and {} more do so", off - 1));
}

// Why images make no regular stack, of which `lost` slices have no image.
std::string irregular_words(const std::vector<DicomFrame>& frames, const Places& places,
                            size_t lost, size_t damaged) {
    size_t widest = 0;
    for (size_t k = 0; k + 1 < frames.size(); ++k)
        if (places.along_mm[k + 1] - places.along_mm[k] >
            places.along_mm[widest + 1] - places.along_mm[widest])
            widest = k;
    std::string what = misplaced_words(frames);
    if (what.empty())
        what = far_words(frames, places, widest);
    if (what.empty() && lost == 0)
        what = outlier_words(frames, places);
    if (what.empty())
        what = lost > 0
                   ? fmt::format("{} slice{} to be missing", lost, lost == 1 ? " seems" : "s seem")
                   : "the slices are not evenly spaced";
    if (damaged > 0)
        what += fmt::format(" ({})", files_words(damaged));
    return fmt::format(
        "{}: {} (largest gap between {} and {}); a regular stack would be wrong by "
        "up to {:.4g} mm, {} interpolates to an even spacing",
        what, gap_words(places.along_mm), leaf(frames[widest]), leaf(frames[widest + 1]),
        places.farthest_mm, Option{"resample-slices"});
}

} // namespace

double tilt_degrees(const Places& places) {
    const double cosine = glm::dot(places.step, places.normal) / glm::length(places.step);
    return std::acos(std::min(1.0, cosine)) * 180 / std::acos(-1.0);
}

Places places_of(const std::vector<DicomFrame>& frames, glm::dvec3 normal) {
    Places places;
    places.normal = normal;
    std::vector<glm::dvec3> points;
    std::vector<double> at;
    for (const DicomFrame& frame : frames) {
        at.push_back(static_cast<double>(points.size()));
        points.push_back(*frame.position);
        places.along_mm.push_back(glm::dot(points.back(), normal));
    }
    const double most = kOfRounding * rounding_mm(points);
    const auto is_rounding = [&](const FittedLine& line) {
        glm::dvec3 off(0.0);
        for (size_t k = 0; k < points.size(); ++k)
            off = glm::max(off, glm::abs(points[k] - (line.first + at[k] * line.step)));
        return std::max({off.x, off.y, off.z}) <= most &&
               line.farthest_mm <= kMostRounded * glm::length(line.step);
    };
    FittedLine line = fit_line(points, at);
    places.within_rounding = is_rounding(line);
    if (!places.within_rounding && line.farthest_mm > kMostUneven * glm::length(line.step)) {
        // Points that are rounded alike for a while look like a line with outliers.
        const FittedLine all = least_squares_line(points, at);
        places.within_rounding = is_rounding(all);
        if (places.within_rounding)
            line = all;
    }
    places.first = line.first;
    places.step = line.step;
    places.off_mm = line.off_mm;
    places.farthest_mm = line.farthest_mm;
    places.sideways_mm = at.back() * glm::length(line.step - glm::dot(line.step, normal) * normal);
    return places;
}

Result<Places> regular_places(const std::string& name, std::vector<DicomFrame>& frames,
                              glm::dvec3 normal, size_t damaged,
                              const std::vector<DicomFrame>& left_out,
                              std::vector<std::string>& warnings) {
    Places places = places_of(frames, normal);
    if (!is_regular(places)) {
        const std::vector<size_t> missing = missing_before(places.along_mm);
        size_t lost = std::accumulate(missing.begin(), missing.end(), size_t{0});
        std::vector<Hole> holes;
        if (lost <= damaged + left_out.size() + frames.size())
            holes = holes_of(frames, missing);
        lost -= explain(holes, frames, left_out);
        if (holes.empty() || lost > damaged)
            return fail("{}: {}", name, irregular_words(frames, places, lost, damaged));
        std::vector<DicomFrame> whole = filled(frames, holes);
        const Places even = places_of(whole, normal);
        if (!is_regular(even))
            return fail("{}: {}", name, irregular_words(frames, places, lost, damaged));
        warn_of_holes(name, holes, whole.size(), damaged, frames.front(), warnings);
        frames = std::move(whole);
        places = even;
    }
    const double usual = glm::length(places.step);
    if (places.farthest_mm > std::max(kPositionRoundingMm, 0.01 * usual))
        warnings.push_back(fmt::format(
            "{}: {}; slices are placed evenly, {:.4g} mm from their "
            "place at most ({} interpolates)",
            name, gap_words(places.along_mm), places.farthest_mm, Option{"resample-slices"}));
    if (places.sideways_mm > 10 * kPositionRoundingMm)
        warnings.push_back(
            fmt::format("{}: gantry tilt: slices are stacked {:.2f} degrees off their normal; the "
                        "shear is kept in the geometry ({} removes it)",
                        name, tilt_degrees(places), Option{"resample-slices"}));
    return places;
}

} // namespace palpate::io
