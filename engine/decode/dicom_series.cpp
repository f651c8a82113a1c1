#include <algorithm>
#include <cmath>
#include <map>

#include "engine/base/assert.h"
#include "engine/decode/dicom_fit.h"
#include "engine/io/text_header.h"

namespace palpate::io {

namespace {

std::string orientation_words(glm::dvec3 normal) {
    constexpr const char* words[] = {"sagittal", "coronal", "axial"};
    for (int i = 0; i < 3; ++i)
        if (std::abs(normal[i]) > 0.999) // 2.6 degrees
            return words[i];
    return fmt::format("oblique (normal {:.3f}, {:.3f}, {:.3f})", normal.x, normal.y, normal.z);
}

std::string content_words(const DicomSeries& series) {
    const DicomFrame& first = series.frames.front();
    const size_t count = series.frames.size();
    if (first.object == DicomObject::other)
        return fmt::format("{} file{} (passed over: {})", count, count == 1 ? "" : "s",
                           first.object_words);
    return fmt::format("{}{} image{} of {}",
                       first.object == DicomObject::segmentation ? "segmentation, " : "", count,
                       count == 1 ? "" : "s", plane_words(first));
}

bool is_read(const DicomSeries& series) {
    return series.frames.front().object != DicomObject::other;
}

// Those whose description is `name`; else those of whose description it is a part.
std::vector<size_t> described(const std::vector<DicomSeries>& all, const std::string& name) {
    std::vector<size_t> whole, part;
    for (size_t i = 0; i < all.size(); ++i) {
        const std::string description = lower_case(all[i].description);
        if (description == name)
            whole.push_back(i);
        if (description.find(name) != std::string::npos)
            part.push_back(i);
    }
    return whole.empty() ? part : whole;
}

} // namespace

bool same_plane(const DicomFrame& a, const DicomFrame& b) {
    if (!same_kind(a, b))
        return false;
    if (a.axes && (glm::distance((*a.axes)[0], (*b.axes)[0]) > kEqualDirection ||
                   glm::distance((*a.axes)[1], (*b.axes)[1]) > kEqualDirection))
        return false;
    return !a.spacing_mm || glm::distance(*a.spacing_mm, *b.spacing_mm) <=
                                kEqualDirection * glm::length(*a.spacing_mm);
}

std::string plane_words(const DicomFrame& frame) {
    std::string text = fmt::format("{} x {}", frame.size.x, frame.size.y);
    if (frame.spacing_mm)
        text += fmt::format(" at {:g} x {:g} mm", frame.spacing_mm->x, frame.spacing_mm->y);
    if (frame.axes)
        text +=
            fmt::format(", {}", orientation_words(glm::cross((*frame.axes)[0], (*frame.axes)[1])));
    return text;
}

std::string leaf(const DicomFrame& frame) {
    const std::string name = frame.file.filename().string();
    return frame.frame == 0 ? name : fmt::format("{} frame {}", name, frame.frame);
}

std::vector<DicomSeries> group_series(std::vector<DicomFrame> frames) {
    std::map<std::string, std::vector<DicomSeries>> by_uid;
    for (DicomFrame& frame : frames) {
        std::vector<DicomSeries>& groups = by_uid[frame.series_uid];
        const auto belongs = [&](const DicomSeries& group) {
            const DicomFrame& first = group.frames.front();
            if (first.object != frame.object)
                return false;
            switch (frame.object) {
                case DicomObject::image:
                    return same_kind(first, frame);
                case DicomObject::segmentation:
                    return first.file == frame.file;
                case DicomObject::other:
                    break;
            }
            return first.object_words == frame.object_words;
        };
        // Neighbours mostly belong together.
        auto group = std::find_if(groups.rbegin(), groups.rend(), belongs);
        if (group == groups.rend()) {
            groups.push_back({frame.series_uid, frame.series_description, frame.modality, {}});
            group = groups.rbegin();
        }
        group->frames.push_back(std::move(frame));
    }
    std::vector<DicomSeries> all;
    for (auto& [uid, groups] : by_uid)
        for (DicomSeries& group : groups) {
            if (group.frames.front().object != DicomObject::image) {
                all.push_back(std::move(group));
                continue;
            }
            for (std::vector<DicomFrame>& plane : split_planes(std::move(group.frames)))
                all.push_back({group.uid, group.description, group.modality, std::move(plane)});
        }
    std::stable_sort(all.begin(), all.end(), [](const DicomSeries& a, const DicomSeries& b) {
        const DicomObject first = a.frames.front().object, second = b.frames.front().object;
        return first != second ? first < second : a.frames.size() > b.frames.size();
    });
    return all;
}

Result<size_t> choose_series(const DecodeRequest& request, const std::vector<DicomSeries>& all) {
    PALPATE_ASSERT(!all.empty());
    const std::string name = request.path.string();
    const auto checked = [&](size_t i) -> Result<size_t> {
        if (is_read(all[i]))
            return i;
        return fail("{}: {}", name, series_line(list_series(all)[i]));
    };
    if (!request.series)
        return checked(0);
    const std::string& wanted = *request.series;
    for (size_t i = 0; i < all.size(); ++i)
        if (all[i].uid == wanted)
            return checked(i);
    if (!wanted.empty() && wanted.size() <= 6 &&
        wanted.find_first_not_of("0123456789") == std::string::npos)
        if (const size_t number = std::stoul(wanted); number >= 1 && number <= all.size())
            return checked(number - 1);
    const std::vector<size_t> found = described(all, lower_case(wanted));
    // Several planes of one series: the first has the most images.
    const bool one = !found.empty() && std::all_of(found.begin(), found.end(), [&](size_t i) {
        return all[i].uid == all[found.front()].uid;
    });
    if (one)
        return checked(found.front());
    std::string list;
    for (const SeriesInfo& series : list_series(all))
        list += (list.empty() ? "" : "; ") + series_line(series);
    return fail("{}: {} series match '{}', expected one of: {}", name,
                found.empty() ? "no" : std::to_string(found.size()), wanted, list);
}

std::vector<SeriesInfo> list_series(const std::vector<DicomSeries>& all,
                                    std::optional<size_t> chosen) {
    std::vector<SeriesInfo> list;
    for (size_t i = 0; i < all.size(); ++i)
        list.push_back({static_cast<uint32_t>(i + 1), static_cast<uint32_t>(all.size()),
                        all[i].modality, all[i].description, content_words(all[i]), all[i].uid,
                        chosen == i});
    return list;
}

} // namespace palpate::io
