#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"

namespace palpate {

// A coded concept of DICOM (PS3.3 8.8).
struct DicomCode {
    std::string scheme;  // "SCT", "DCM", "FMA", "99LOCAL"
    std::string value;   // at most 16 characters
    std::string meaning; // at most 64

    friend bool operator==(const DicomCode&, const DicomCode&) = default;
};

// The codes by which a segmentation states what a segment is.
struct SegmentCode {
    DicomCode category{"SCT", "85756007", "Tissue"};
    DicomCode type{"SCT", "85756007", "Tissue"};
    std::optional<DicomCode> modifier; // such as the side

    friend bool operator==(const SegmentCode&, const SegmentCode&) = default;
};

// Codes by the names of labels.
class SegmentCodes {
 public:
    // Reads a table, a line each: the name of a label or its number, then category, type and, where
    // it has one, modifier, apart by semicolons; a code is SCHEME|VALUE|MEANING. Empty lines and
    // those that begin with # are passed over. An error names file and line.
    static Result<SegmentCodes> load(const std::filesystem::path& path);

    // The first of these that there is: the table's line of that number, its line of that name, the
    // structure of that name among those that Palpate knows, and the code of tissue. Names are
    // equal whatever the case, the order of their words and what lies between them; what Palpate
    // knows it also finds with a side ("kidney_right", "Left Kidney").
    SegmentCode code_of(uint32_t label, std::string_view name) const;

 private:
    struct Line {
        std::string name; // as key_of() has it
        std::optional<uint32_t> number;
        SegmentCode code;
    };
    std::vector<Line> lines_;
};

namespace io {

// A structure that Palpate knows by name.
struct KnownStructure {
    const char* names; // lower case; several apart by commas
    const char* code;  // of SNOMED CT
    const char* meaning;
    bool altered = false; // a morphologically altered structure, such as a tumour
};
const std::vector<KnownStructure>& known_structures();

} // namespace io

} // namespace palpate
