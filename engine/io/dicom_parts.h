#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace palpate {

// One element of a data set, as text.
struct DicomAttribute {
    uint32_t tag = 0;  // group in the high half
    std::string value; // UTF-8; backslashes stand between several values

    friend bool operator==(const DicomAttribute&, const DicomAttribute&) = default;
};

// The image of one slice of a series.
struct DicomSlice {
    std::string class_uid, instance_uid; // empty where no image lies at the slice
    uint32_t frame = 0;                  // of a multi-frame image, from 1; 0 of a single one

    friend bool operator==(const DicomSlice&, const DicomSlice&) = default;
};

// The parts that an object takes over from a series of images: the patient and the study it belongs
// to, the frame of reference in which its coordinates hold, and the images it refers to.
struct DicomParts {
    std::string study_uid, series_uid, frame_of_reference_uid;
    std::vector<DicomAttribute> attributes; // of patient and study, by rising tag
    std::vector<DicomSlice> slices;         // one for each slice of the grid

    friend bool operator==(const DicomParts&, const DicomParts&) = default;
};

namespace io {

// An attribute of patient, study or frame of reference (PS3.3 C.7.1.1, C.7.2.1, C.7.2.2, C.7.4.1)
// that a new object of the same study repeats.
struct TakenAttribute {
    uint32_t tag;
    const char* representation;
    bool always; // also where it is empty (type 2)
};
inline constexpr TakenAttribute kTakenAttributes[] = {
    {0x00080020, "DA", true},  // Study Date
    {0x00080030, "TM", true},  // Study Time
    {0x00080050, "SH", true},  // Accession Number
    {0x00080090, "PN", true},  // Referring Physician's Name
    {0x00081030, "LO", false}, // Study Description
    {0x00100010, "PN", true},  // Patient's Name
    {0x00100020, "LO", true},  // Patient ID
    {0x00100021, "LO", false}, // Issuer of Patient ID
    {0x00100030, "DA", true},  // Patient's Birth Date
    {0x00100040, "CS", true},  // Patient's Sex
    {0x00101010, "AS", false}, // Patient's Age
    {0x00101020, "DS", false}, // Patient's Size
    {0x00101030, "DS", false}, // Patient's Weight
    {0x00120062, "CS", false}, // Patient Identity Removed
    {0x00120063, "LO", false}, // De-identification Method
    {0x00200010, "SH", true},  // Study ID
    {0x00201040, "LO", true},  // Position Reference Indicator
};

// The modality of structure sets (PS3.3 C.7.3.1.1.1).
constexpr const char* kStructureSet = "RTSTRUCT";

// An item of the Segment Sequence keeps the label of a segment under these (PS3.5 7.8.1).
constexpr const char* kPrivateCreator = "PALPATE";
constexpr uint32_t kPrivateCreatorTag = 0x00630010, kPrivateLabelTag = 0x00631001;

} // namespace io

} // namespace palpate
