#pragma once

#include <string>
#include <vector>

#include "engine/scene/value_survey.h"

// Hounsfield units of a CT, whose files may lack the offset that makes them: scanners count from
// -1024, and some converters store what they count.
namespace palpate {

constexpr double kLostCtOffset = 1024.0;

// The statistics of a volume, or of the finest of its coarser levels that has no more than 256^3
// samples.
ValueSurvey survey_of(const Volume& volume, const std::vector<Volume>& coarser);

// Whether the values of a CT are HU + 1024: none lies below -200 HU, where air, lungs and the bed
// are, and a quarter lies above 800. False for other modalities ("MR", "").
bool lacks_ct_offset(const std::string& modality, const Volume& volume, const ValueSurvey& values);
bool lacks_ct_offset(const std::string& modality, const Volume& volume,
                     const std::vector<Volume>& coarser);

} // namespace palpate
