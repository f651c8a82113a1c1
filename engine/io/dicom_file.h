#pragma once

#include <span>

#include "engine/io/dicom_stack.h"

// One DICOM file, read through GDCM.
namespace palpate::io {

// What a file's header says, without its pixels.
struct DicomFile {
    std::filesystem::path path;
    std::vector<DicomFrame> frames; // in the order in which the file stores them; one or more
    ComponentType type{};           // of the stored samples
    double most_expansion = 1.0;    // of the pixel data's encoding, see VoxelClaim
    uint64_t bytes = 0;             // of the file
    std::vector<std::string> warnings;
};

// An error where the file is no DICOM image: it says what it is instead.
Result<DicomFile> read_dicom_header(const std::filesystem::path& path);

// The samples of every frame, in native byte order; exactly as many bytes as the header claims.
Result<std::vector<char>> read_dicom_pixels(const DicomFile& file);

} // namespace palpate::io
