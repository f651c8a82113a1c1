#pragma once

#include <glm/glm.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "engine/io/dicom_parts.h"
#include "engine/io/dicom_set.h"
#include "engine/io/label_names.h"
#include "engine/io/segment_codes.h"

// The parts that all objects have which are made from a series of images.
namespace palpate::io {

struct NewObject {
    std::string class_uid, instance_uid;
    std::string modality;    // "SEG"
    std::string description; // of its series
};

// Patient, study, frame of reference, new series, equipment and SOP common, in UTF-8. Values of the
// reference that their representation does not allow are left empty.
DicomSet object_of(const DicomParts& reference, const NewObject& object);

// Now, as DA and TM.
struct DicomMoment {
    std::string date, time;
};
DicomMoment moment_now();

DicomSet code_item(const DicomCode& code);
// The UID of a reference; empty where it is longer than 64 or no numbers with dots between them.
std::string allowed_uid(const std::string& uid);

// Whether an image lies at the slice, and has UIDs under which it can be referred to.
bool has_image(const DicomSlice& slice);

DicomSet instance_item(const DicomSlice& slice); // class and instance, and the frame of several

// Each image that the slices of the reference refer to, once.
std::vector<DicomSlice> instances_of(const DicomParts& reference);

// A label as objects name it.
struct NamedSegment {
    std::string name; // as plain_text(), "Label 7" where it has none
    glm::dvec3 color; // the generated one where it has none
    SegmentCode code;
};
NamedSegment named_segment(uint16_t label, std::span<const LabelName> names,
                           const SegmentCodes& codes);

// An error where labels of a known frame of reference (empty: unknown) lie in another one.
Result<void> check_frame_of_reference(const std::string& name, const std::string& of_labels,
                                      const DicomParts& reference);

// Text without control characters and backslashes, of at most so many letters, not ended by a
// space.
std::string plain_text(std::string_view text, size_t most_letters);

} // namespace palpate::io
