#pragma once

#include "engine/decode/dicom_elements.h"
#include "engine/decode/frame_marks.h"

namespace palpate::io {

// Takes what a data set states: the elements of classic images, and the b-values that Siemens, GE
// and Philips keep in private ones. What is absent changes nothing.
void take_marks(const gdcm::DataSet& set, FrameMarks& marks);

// The same from the functional groups of an enhanced multi-frame image.
void take_group_marks(const gdcm::DataSet& groups, FrameMarks& marks);

// Seconds from 2000-01-01 to a date and time (DT, or DA and TM one after the other; PS3.5 6.2); an
// offset from UTC is taken into account. Empty where it is malformed or has no hour.
std::optional<double> seconds_of(const std::string& date_time);

} // namespace palpate::io
