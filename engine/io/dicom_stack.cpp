#include "engine/io/dicom_stack.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "engine/base/assert.h"
#include "engine/io/text_header.h"

namespace palpate::io {

namespace {

// Positions and spacings are decimal strings, often of few digits: this much is rounding.
constexpr double kPositionRoundingMm = 0.01;
// Direction cosines of one series are written alike; 1e-4 is 0.006 degrees.
constexpr double kSameDirection = 1e-4;
// Beyond this share of the step, a slice put on the regular lattice would be in a wrong place.
constexpr double kMostUneven = 0.1;

std::string leaf(const DicomFrame& frame) {
    const std::string name = frame.file.filename().string();
    return frame.frame == 0 ? name : fmt::format("{} frame {}", name, frame.frame);
}

std::string listed(const std::vector<DicomSeries>& all) {
    std::string text;
    for (const DicomSeries& series : all)
        text +=
            fmt::format("{}'{}' ({})", text.empty() ? "" : ", ", series.description, series.uid);
    return text;
}

bool same_plane(const DicomFrame& a, const DicomFrame& b) {
    if (a.size != b.size || a.axes.has_value() != b.axes.has_value() ||
        a.position.has_value() != b.position.has_value())
        return false;
    if (a.axes && (glm::distance((*a.axes)[0], (*b.axes)[0]) > kSameDirection ||
                   glm::distance((*a.axes)[1], (*b.axes)[1]) > kSameDirection))
        return false;
    if (a.spacing_mm.has_value() != b.spacing_mm.has_value())
        return false;
    return !a.spacing_mm || glm::distance(*a.spacing_mm, *b.spacing_mm) <=
                                kSameDirection * glm::length(*a.spacing_mm);
}

std::string plane_words(const DicomFrame& frame) {
    std::string text = fmt::format("{} x {}", frame.size.x, frame.size.y);
    if (frame.spacing_mm)
        text += fmt::format(" at {:g} x {:g} mm", frame.spacing_mm->x, frame.spacing_mm->y);
    if (frame.axes) {
        const glm::dvec3 n = glm::cross((*frame.axes)[0], (*frame.axes)[1]);
        text += fmt::format(", normal ({:.3f}, {:.3f}, {:.3f})", n.x, n.y, n.z);
    }
    return text;
}

// Keeps the images of the most frequent size and orientation.
Result<void> keep_majority(const std::string& name, std::vector<DicomFrame>& frames,
                           std::vector<std::string>& warnings) {
    std::vector<std::vector<DicomFrame>> kinds;
    for (DicomFrame& frame : frames) {
        auto kind = std::find_if(kinds.begin(), kinds.end(),
                                 [&](const auto& k) { return same_plane(k.front(), frame); });
        if (kind == kinds.end())
            kind = kinds.emplace(kinds.end());
        kind->push_back(std::move(frame));
    }
    std::stable_sort(kinds.begin(), kinds.end(),
                     [](const auto& a, const auto& b) { return a.size() > b.size(); });
    if (kinds.size() > 1) {
        const DicomFrame &first = kinds[0].front(), &other = kinds[1].front();
        const std::string what = fmt::format(
            "mixed sizes or orientations: {} images like {} ({}), {} like {} ({})", kinds[0].size(),
            leaf(first), plane_words(first), kinds[1].size(), leaf(other), plane_words(other));
        if (2 * kinds[0].size() <= frames.size())
            return fail("{}: {}", name, what);
        warnings.push_back(fmt::format("{}: {}; {} of {} images are left out", name, what,
                                       frames.size() - kinds[0].size(), frames.size()));
    }
    frames = std::move(kinds[0]);
    return {};
}

void drop_copies(const std::string& name, std::vector<DicomFrame>& frames,
                 std::vector<std::string>& warnings) {
    std::map<std::pair<std::string, uint32_t>, std::string> seen;
    std::string example;
    const size_t before = frames.size();
    std::erase_if(frames, [&](const DicomFrame& frame) {
        if (frame.instance_uid.empty())
            return false;
        const auto [at, is_new] = seen.try_emplace({frame.instance_uid, frame.frame}, leaf(frame));
        if (!is_new && example.empty())
            example = fmt::format("{} repeats {}", leaf(frame), at->second);
        return !is_new;
    });
    if (frames.size() < before)
        warnings.push_back(fmt::format("{}: {} images are there twice ({}); one of each is read",
                                       name, before - frames.size(), example));
}

glm::dmat2x3 axes_of(const DicomFrame& frame) {
    return frame.axes.value_or(glm::dmat2x3{{1, 0, 0}, {0, 1, 0}});
}

double along_normal(const DicomFrame& frame, glm::dvec3 normal) {
    return glm::dot(*frame.position, normal);
}

// Several images at each position are frames of a 4-D series: keeps the one asked for.
Result<void> keep_frame(const DecodeRequest& request, glm::dvec3 normal,
                        std::vector<DicomFrame>& frames, std::vector<std::string>& warnings) {
    std::vector<std::vector<DicomFrame>> places;
    for (DicomFrame& frame : frames) {
        if (places.empty() ||
            along_normal(frame, normal) - along_normal(places.back().front(), normal) >
                kPositionRoundingMm)
            places.emplace_back();
        places.back().push_back(std::move(frame));
    }
    for (const auto& place : places)
        if (place.size() != places.front().size()) {
            const auto& more = place.size() > places.front().size() ? place : places.front();
            return fail(
                "{}: duplicate positions: {} and {} lie both at {:.3f} mm along the "
                "normal, while other positions have another number of images",
                request.path.string(), leaf(more[0]), leaf(more[1]), along_normal(more[0], normal));
        }
    const auto count = static_cast<uint32_t>(places.front().size());
    const Result<uint32_t> chosen = choose_frame(request, count, warnings);
    if (!chosen)
        return fail("{}", chosen.error().message);
    frames.clear();
    for (auto& place : places) {
        std::stable_sort(place.begin(), place.end(), [](const auto& a, const auto& b) {
            return a.instance_number < b.instance_number;
        });
        frames.push_back(std::move(place[*chosen]));
    }
    return {};
}

// The step from slice to slice of sorted images, in world mm.
Result<glm::dvec3> slice_step(const std::string& name, const std::vector<DicomFrame>& frames,
                              glm::dvec3 normal, std::vector<std::string>& warnings) {
    const size_t last = frames.size() - 1;
    const glm::dvec3 first = *frames[0].position;
    const glm::dvec3 step = (*frames[last].position - first) / static_cast<double>(last);
    const double usual = glm::length(step);

    double largest_gap = 0, smallest_gap = usual * static_cast<double>(last), farthest = 0;
    size_t at = 0;
    for (size_t k = 0; k < last; ++k) {
        const double gap = glm::distance(*frames[k].position, *frames[k + 1].position);
        smallest_gap = std::min(smallest_gap, gap);
        if (gap > largest_gap) {
            largest_gap = gap;
            at = k;
        }
        farthest = std::max(
            farthest, glm::distance(*frames[k].position, first + static_cast<double>(k) * step));
    }
    if (farthest > std::max(kPositionRoundingMm, 0.01 * usual)) {
        const std::string what = fmt::format(
            "the gaps between slices vary from {:.4g} to {:.4g} mm (largest between {} and {})",
            smallest_gap, largest_gap, leaf(frames[at]), leaf(frames[at + 1]));
        if (farthest > kMostUneven * usual) {
            const double missing = std::round(largest_gap / smallest_gap) - 1;
            return fail(
                "{}: {}; {} and a regular stack would be wrong by up to {:.4g} mm", name, what,
                missing >= 1 ? fmt::format("{:.0f} slices seem to be missing there", missing)
                             : "they are uneven",
                farthest);
        }
        warnings.push_back(
            fmt::format("{}: {}; slices are placed evenly, {:.4g} mm from their "
                        "place at most",
                        name, what, farthest));
    }
    const double tilt = std::acos(std::min(1.0, glm::dot(step, normal) / usual));
    if (usual * std::sin(tilt) * static_cast<double>(last) > 10 * kPositionRoundingMm)
        warnings.push_back(
            fmt::format("{}: gantry tilt: slices are stacked {:.2f} degrees off "
                        "their normal; the shear is kept in the geometry",
                        name, tilt * 180 / std::acos(-1.0)));
    return step;
}

void assume_what_is_absent(const std::string& name, DicomFrame& first, size_t count,
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

std::vector<DicomSeries> group_series(std::vector<DicomFrame> frames) {
    std::map<std::string, DicomSeries> by_uid;
    for (DicomFrame& frame : frames) {
        DicomSeries& series = by_uid[frame.series_uid];
        series.uid = frame.series_uid;
        series.description = frame.series_description;
        series.modality = frame.modality;
        series.frames.push_back(std::move(frame));
    }
    std::vector<DicomSeries> all;
    for (auto& [uid, series] : by_uid)
        all.push_back(std::move(series));
    std::stable_sort(all.begin(), all.end(), [](const DicomSeries& a, const DicomSeries& b) {
        return a.frames.size() > b.frames.size();
    });
    return all;
}

Result<size_t> choose_series(const DecodeRequest& request, const std::vector<DicomSeries>& all) {
    PALPATE_ASSERT(!all.empty());
    if (!request.series)
        return 0;
    std::vector<size_t> found;
    for (size_t i = 0; i < all.size(); ++i) {
        if (all[i].uid == *request.series)
            return i;
        if (lower_case(all[i].description).find(lower_case(*request.series)) != std::string::npos)
            found.push_back(i);
    }
    if (found.size() != 1)
        return fail("{}: {} series match '{}', expected one of: {}", request.path.string(),
                    found.empty() ? "no" : std::to_string(found.size()), *request.series,
                    listed(all));
    return found.front();
}

Result<DicomStack> make_stack(const DecodeRequest& request, DicomSeries series) {
    const std::string name = request.path.string();
    DicomStack stack;
    std::vector<DicomFrame>& frames = stack.frames = std::move(series.frames);
    drop_copies(name, frames, stack.warnings);
    if (Result<void> kept = keep_majority(name, frames, stack.warnings); !kept)
        return pass_on(kept);

    const glm::dmat2x3 axes = axes_of(frames.front());
    const glm::dvec3 normal = glm::cross(axes[0], axes[1]);
    if (std::abs(glm::length(normal) - 1) > 1e-3)
        return fail("{}: the image axes of {} are no unit vectors at right angles", name,
                    leaf(frames.front()));
    const bool placed = frames.front().position.has_value();
    std::stable_sort(frames.begin(), frames.end(), [&](const DicomFrame& a, const DicomFrame& b) {
        return placed ? along_normal(a, normal) < along_normal(b, normal)
                      : a.instance_number < b.instance_number;
    });
    if (placed) {
        if (Result<void> kept = keep_frame(request, normal, frames, stack.warnings); !kept)
            return pass_on(kept);
    } else if (frames.size() > 1 && frames[0].file == frames[1].file) {
        // Frames of one file without places are frames in time.
        const auto count = static_cast<uint32_t>(frames.size());
        const Result<uint32_t> chosen = choose_frame(request, count, stack.warnings);
        if (!chosen)
            return fail("{}", chosen.error().message);
        frames = {frames[*chosen]};
    }
    DicomFrame& first = frames.front();
    assume_what_is_absent(name, first, frames.size(), stack.warnings);
    const glm::dvec2 spacing = first.spacing_mm.value_or(glm::dvec2(1.0));
    glm::dvec3 step = normal * first.slice_step_mm.value_or(1.0);
    if (placed && frames.size() > 1) {
        const Result<glm::dvec3> found = slice_step(name, frames, normal, stack.warnings);
        if (!found)
            return fail("{}", found.error().message);
        step = *found;
    }
    const glm::dvec3 origin = first.position.value_or(glm::dvec3(0.0));
    stack.grid.size = {first.size, frames.size()};
    stack.grid.world_from_index = {glm::dvec4(axes[0] * spacing.x, 0.0),
                                   glm::dvec4(axes[1] * spacing.y, 0.0), glm::dvec4(step, 0.0),
                                   glm::dvec4(origin, 1.0)};
    return stack;
}

} // namespace palpate::io
