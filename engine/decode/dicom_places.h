#pragma once

#include "engine/decode/dicom_stack.h"

// The places of the slices of a stack, and whether they are regular.
namespace palpate::io {

// The images of a stack, sorted along their normal, and an even stack that fits them.
struct Places {
    glm::dvec3 normal{};
    std::vector<double> along_mm; // on the normal, rising
    glm::dvec3 first{}, step{};   // slice k of the even stack lies at first + k step (fit_line)
    std::vector<double> off_mm;   // of each image from its slice
    double farthest_mm = 0;       // the largest of them
    double sideways_mm = 0;       // by which the last slice lies off the first's normal
    bool within_rounding = false; // rounded decimals of positions explain all of off_mm
};

// The angle between the row of slices and their normal.
double tilt_degrees(const Places& places);

// Two or more images that state their position.
Places places_of(const std::vector<DicomFrame>& frames, glm::dvec3 normal);

// The even stack of sorted images. Slices without an image are put into `frames` where files that
// were passed over explain them: up to `damaged` ones, and images in `left_out` (of another
// orientation, spacing or size) that lie there or are numbered so. What departs from a regular
// stack is a warning, or an error that names what was found.
Result<Places> regular_places(const std::string& name, std::vector<DicomFrame>& frames,
                              glm::dvec3 normal, size_t damaged,
                              const std::vector<DicomFrame>& left_out,
                              std::vector<std::string>& warnings);

} // namespace palpate::io
