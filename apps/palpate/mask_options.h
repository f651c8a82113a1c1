#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "engine/edit/edit_mask.h"

namespace palpate {

// The options of a mask, as they were typed.
struct MaskOptions {
    std::string inside, outside, over;
    std::vector<double> only_values;
};

void add_mask_options(CLI::App& app, MaskOptions& options); // which outlive the app
Result<EditMask> mask_of(const MaskOptions& options);

} // namespace palpate
