#pragma once

#include "engine/decode/dicom_file.h"

// The DICOM files that a folder, a DICOMDIR or a single path stands for.
namespace palpate::io {

// Whether a folder or one below it holds a file that looks like DICOM.
bool holds_dicom(const std::filesystem::path& folder, const VoxelSink& sink);

// The headers of the objects found.
struct DicomFiles {
    std::map<std::filesystem::path, DicomFile> files; // by name, so that results do not vary
    size_t damaged = 0; // files that look like DICOM and could not be read, each with a warning
    std::vector<std::string> warnings, notes;
};

// Reads the headers of a file; of the files that a DICOMDIR names; or of all that look like DICOM
// in a folder and those below it, at most 16 deep and 200,000 files (a warning tells what was left
// out). Links to folders are not followed. An error where nothing can be read; of a single file,
// also where it is no image.
Result<DicomFiles> read_dicom_headers(const DecodeRequest& request, const VoxelSink& sink);

// Puts a file aside as damaged, with a warning.
void set_aside(DicomFiles& found, const std::filesystem::path& path, const std::string& why);

} // namespace palpate::io
