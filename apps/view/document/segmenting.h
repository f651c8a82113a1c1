#pragma once

#include <map>
#include <optional>
#include <string>

#include "engine/segment/methods.h"

namespace palpate::view {

enum class SeedBrush { inside, outside, erase };

// A person's wishes for a segmentation. A part of ViewState.
struct Segmenting {
    SeedBrush brush = SeedBrush::inside; // inside: of the label that is drawn
    std::string method = "fast-marching";
    std::map<std::string, ParameterValues> given{}; // by method; others are the method's own
    // While a person drags the bound of the last result, and until it is taken: where it is.
    bool in_box = false; // methods work within the box that clip planes leave, alone
    std::optional<double> preview{};

    friend bool operator==(const Segmenting&, const Segmenting&) = default;
};

} // namespace palpate::view
