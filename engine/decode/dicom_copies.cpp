#include "engine/decode/dicom_copies.h"

#include <algorithm>
#include <map>

namespace palpate::io {

namespace {

// One frame of an instance.
using Instance = std::pair<std::string, uint32_t>;

bool lie_together(const DicomFrame& a, const DicomFrame& b) {
    return a.size == b.size && a.position.has_value() == b.position.has_value() &&
           (!a.position || glm::distance(*a.position, *b.position) <= kPositionRoundingMm);
}

std::string images_words(size_t count) {
    return fmt::format("{} image{}", count, count == 1 ? "" : "s");
}

// "b/1.dcm repeats a/1.dcm": with folders where the names alone are the same.
std::string repeats_text(const std::filesystem::path& copy, const std::filesystem::path& first) {
    const auto with_folder = [](const std::filesystem::path& file) {
        return (file.parent_path().filename() / file.filename()).string();
    };
    return copy.filename() != first.filename()
               ? fmt::format("{} repeats {}", copy.filename().string(), first.filename().string())
               : fmt::format("{} repeats {}", with_folder(copy), with_folder(first));
}

} // namespace

void drop_copies(const std::string& name, std::vector<DicomFrame>& frames,
                 std::vector<std::string>& warnings) {
    std::map<Instance, std::filesystem::path> seen;
    std::string example;
    const size_t before = frames.size();
    std::erase_if(frames, [&](const DicomFrame& frame) {
        if (frame.instance_uid.empty())
            return false;
        const auto [at, is_new] = seen.try_emplace({frame.instance_uid, frame.frame}, frame.file);
        if (!is_new && example.empty())
            example = repeats_text(frame.file, at->second);
        return !is_new;
    });
    if (const size_t copies = before - frames.size(); copies > 0)
        warnings.push_back(fmt::format("{}: {} {} there twice ({}); one of each is read", name,
                                       images_words(copies), copies == 1 ? "is" : "are", example));

    std::map<Instance, DicomFrame> sources;
    for (const DicomFrame& frame : frames)
        if (frame.lossless_uid.empty() && !frame.instance_uid.empty())
            sources.emplace(Instance(frame.instance_uid, frame.frame), frame);
    const size_t left = frames.size();
    std::erase_if(frames, [&](const DicomFrame& frame) {
        const auto source = sources.find({frame.lossless_uid, frame.frame});
        if (source == sources.end() || !lie_together(frame, source->second))
            return false;
        example = fmt::format("{} of {}", leaf(frame), leaf(source->second));
        return true;
    });
    if (const size_t versions = left - frames.size(); versions > 0)
        warnings.push_back(
            fmt::format("{}: {} {} of others that lost detail in compression ({}); they are left "
                        "out",
                        name, images_words(versions),
                        versions == 1 ? "is a version" : "are versions", example));
}

bool drop_equal_images(const std::string& name, std::vector<std::vector<DicomFrame>>& places,
                       const SameSamples& same_samples, std::vector<std::string>& warnings) {
    size_t copies = 0;
    std::string example;
    for (const std::vector<DicomFrame>& place : places)
        for (size_t i = 1; i < place.size(); ++i, ++copies) {
            if (!same_samples(place.front(), place[i]))
                return false;
            example = repeats_text(place[i].file, place.front().file);
        }
    for (std::vector<DicomFrame>& place : places)
        place.resize(1);
    warnings.push_back(
        fmt::format("{}: {} {} the same samples as others at {} ({}); one at each "
                    "place is read",
                    name, images_words(copies), copies == 1 ? "has" : "have",
                    copies == 1 ? "its place" : "their places", example));
    return true;
}

} // namespace palpate::io
