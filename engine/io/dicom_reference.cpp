#include "engine/io/dicom_reference.h"

#include "engine/base/printable.h"
#include "engine/io/dicom_modules.h"
#include "engine/io/dicom_set.h"
#include "engine/io/narrow.h"
#include "engine/io/sandbox.h"

namespace palpate {

namespace {

// An error where an object would be without a UID that it must have.
Result<void> check_uid(const std::string& name, const char* what, const std::string& uid) {
    if (!io::allowed_uid(uid).empty())
        return {};
    return fail(
        "{}: its images state '{}' as their {}, expected numbers with dots between them, at most "
        "64 characters",
        name, printable(uid.substr(0, 80)), what);
}

} // namespace

Result<DicomReference> load_dicom_reference(const std::filesystem::path& path,
                                            const ReadOptions& options) {
    io::DecodeRequest request{path, options.frame, options.series};
    request.reference = true;
    PALPATE_TRY(io::DecodedVoxels found, io::decode_in_child(request, options));
    if (!found.decoded.reference)
        return fail(
            "{}: expected a series of DICOM images as the reference, found {}", path.string(),
            found.decoded.modality.empty() ? "a file of another format"
                                           : "a file of the kind " + found.decoded.modality);
    DicomReference reference{std::move(*found.decoded.reference), found.decoded.grid,
                             std::move(found.decoded.warnings)};
    PALPATE_TRY(check_uid(path.string(), "Study Instance UID", reference.parts.study_uid));
    PALPATE_TRY(check_uid(path.string(), "Series Instance UID", reference.parts.series_uid));
    if (std::string& uid = reference.parts.frame_of_reference_uid; uid.empty()) {
        uid = io::new_uid();
        reference.warnings.push_back(fmt::format(
            "{}: states no frame of reference (Frame of Reference UID), so that what refers to it "
            "gets a new one",
            path.string()));
    }
    PALPATE_TRY(
        check_uid(path.string(), "Frame of Reference UID", reference.parts.frame_of_reference_uid));
    return reference;
}

Result<LoadedVolume> load_structures(const std::filesystem::path& path,
                                     const std::filesystem::path& reference,
                                     const ReadOptions& options) {
    io::DecodeRequest request{path, {}, {}};
    request.onto = reference;
    request.onto_series = options.series;
    PALPATE_TRY(const io::DecodedVoxels voxels, io::decode_in_child(request, options));
    if (voxels.decoded.modality != io::kStructureSet)
        return fail("{}: expected a DICOM structure set (RTSTRUCT), found another file",
                    path.string());
    return io::narrow(path.string(), voxels.decoded, voxels.claim, voxels.bytes(),
                      io::VolumeKind::labels, options.max_memory_bytes);
}

} // namespace palpate
