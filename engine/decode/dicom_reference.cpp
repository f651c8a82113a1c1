#include "engine/decode/dicom_reference.h"

#include <gdcmReader.h>

#include <algorithm>

#include "engine/base/printable.h"
#include "engine/decode/dicom_elements.h"
#include "engine/decode/dicom_source.h"
#include "engine/decode/dicom_text.h"

namespace palpate::io {

namespace {

using gdcm::Tag;

// Reads the file without its pixels.
Result<void> take_attributes(const std::string& name, const DicomFile& file, DicomParts& parts) {
    const Tag pixels(0x7fe0, file.pixel_element);
    gdcm::Reader reader;
    PALPATE_TRY(const auto stream, give_file(reader, file.path, file.deflated_at, file.pixels_at));
    if (!reader.ReadUpToTag(pixels, {pixels}))
        return fail("{}: is no DICOM file, or a damaged one", file.path.string());
    const gdcm::DataSet& set = reader.GetFile().GetDataSet();
    parts.study_uid = text(set, Tag(0x0020, 0x000d));
    if (parts.study_uid.empty())
        return fail("{}: its images state no study (Study Instance UID)", name);
    const std::vector<std::string> sets = texts(set, Tag(0x0008, 0x0005));
    for (const TakenAttribute& taken : kTakenAttributes)
        if (const std::string value = text(set, Tag(taken.tag)); !value.empty())
            parts.attributes.push_back({taken.tag, utf8_of(value, sets)});
    return {};
}

} // namespace

Result<DicomParts> reference_of(const std::string& name,
                                const std::map<std::filesystem::path, DicomFile>& files,
                                const DicomStack& stack) {
    if (stack.resampled)
        return fail("{}: its images do not lie on an even grid, so that no slice refers to one",
                    name);
    DicomParts parts;
    for (const DicomFrame& frame : stack.frames) {
        if (frame.file.empty()) { // missing in the series
            parts.slices.emplace_back();
            continue;
        }
        const DicomFile& file = files.at(frame.file);
        if (parts.study_uid.empty()) {
            PALPATE_TRY(take_attributes(name, file, parts));
            parts.series_uid = frame.series_uid;
            parts.frame_of_reference_uid = frame.frame_of_reference;
        }
        if (frame.frame_of_reference != parts.frame_of_reference_uid)
            return fail("{}: its images lie in several frames of reference ('{}' and '{}')", name,
                        printable(parts.frame_of_reference_uid),
                        printable(frame.frame_of_reference));
        if (frame.series_uid.empty() || frame.class_uid.empty() || frame.instance_uid.empty())
            return fail("{}: {} does not state the UIDs of its series, class and instance", name,
                        leaf(frame));
        const bool several = file.frames.size() > 1 && !file.mosaic;
        parts.slices.push_back(
            {frame.class_uid, frame.instance_uid, several ? frame.frame + 1 : 0});
    }
    return parts;
}

} // namespace palpate::io
