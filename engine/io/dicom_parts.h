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

// The modality of structure sets (PS3.3 C.7.3.1.1.1).
constexpr const char* kStructureSet = "RTSTRUCT";

// An item of the Segment Sequence keeps the label of a segment under these (PS3.5 7.8.1).
constexpr const char* kPrivateCreator = "PALPATE";
constexpr uint32_t kPrivateCreatorTag = 0x00630010, kPrivateLabelTag = 0x00631001;

} // namespace io

} // namespace palpate
