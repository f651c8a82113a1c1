#include "engine/io/hounsfield.h"

namespace palpate {

namespace {

constexpr double kAirEnds_hu = -200.0; // air, lung and the bed lie below
constexpr uint64_t kMostSamplesLookedAt = 256ull * 256 * 256;

bool may_lack_it(const std::string& modality, const Volume& volume) {
    return modality == "CT" && volume.range().min >= kAirEnds_hu;
}

} // namespace

ValueSurvey survey_of(const Volume& volume, const std::vector<Volume>& coarser) {
    if (sample_count(volume.grid()) > kMostSamplesLookedAt)
        for (const Volume& level : coarser)
            if (sample_count(level.grid()) <= kMostSamplesLookedAt)
                return survey_values(level);
    return survey_values(volume);
}

bool lacks_ct_offset(const std::string& modality, const Volume& volume, const ValueSurvey& values) {
    return may_lack_it(modality, volume) && values.upper_quarter > 800.0;
}

bool lacks_ct_offset(const std::string& modality, const Volume& volume,
                     const std::vector<Volume>& coarser) {
    return may_lack_it(modality, volume) &&
           lacks_ct_offset(modality, volume, survey_of(volume, coarser));
}

} // namespace palpate
