#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "engine/base/error.h"

// The structure of a DICOM file, looked through before GDCM sees it: GDCM ends the process where
// the head of an element is cut off, and makes up what is missing elsewhere.
namespace palpate::io {

// Walks over the meta header and every element, item and fragment of encoded pixels (PS3.5 7 and
// A.4, PS3.10 7): tags, representations and lengths; values are passed over. Explicit and implicit
// little-endian, explicit big-endian and deflated data sets. Sequences may be nested 32 deep, and
// hold 2^24 elements in all.
//
// An error names the file, the tag and the byte at which the element begins (of the data set, where
// it is deflated).
constexpr const char* kDeflatedSyntax = "1.2.840.10008.1.2.1.99";
constexpr const char* kExplicitSyntax = "1.2.840.10008.1.2.1"; // little-endian

struct DicomStructure {
    std::string syntax;         // UID of the transfer syntax; empty where the file states none
    uint16_t pixel_element = 0; // (7fe0,xxxx) of the pixel data: 0008, 0009 or 0010; 0: none
    uint64_t deflated_at = 0;   // the byte at which a deflated data set begins; 0: none does
    uint64_t pixels_at = 0; // the byte of the data set at which the pixel data begins, or its end
};
Result<DicomStructure> check_structure(const std::filesystem::path& path);

} // namespace palpate::io
