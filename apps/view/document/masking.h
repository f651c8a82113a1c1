#pragma once

#include <cstdint>

#include "engine/edit/edit_mask.h"

namespace palpate::view {

struct ViewState;

// A person's wishes where tools on labels and methods may change samples, beside the range of
// values (ViewState::only_values). A part of ViewState.
struct Masking {
    enum class Area { everywhere, inside_label, outside_label, inside_all, outside_all };
    enum class Overwrite { all, unlabelled, label };
    Area area = Area::everywhere;
    uint16_t area_label = 1; // of inside_label and outside_label
    Overwrite overwrite = Overwrite::all;
    uint16_t over_label = 1; // of Overwrite::label: it and samples without a label

    friend bool operator==(const Masking&, const Masking&) = default;
};

// Said where a change of labels has met the mask.
constexpr const char* kMaskText = "the mask keeps the other samples as they were";

EditMask edit_mask(const ViewState& state);

} // namespace palpate::view
