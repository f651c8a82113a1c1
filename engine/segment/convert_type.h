#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "engine/segment/brick_maker.h"

namespace palpate {

// The type of a name as name_of() gives it.
std::optional<ScalarType> scalar_type_named(std::string_view name);

// Each sample as the nearest value of the type (of two the even one); those beyond its range become
// its limits, and for whole numbers, those without data become 0.
BrickMaker converted_bricks(const Volume& volume, ScalarType type);

// A sentence on values that no rounding explains: beyond the type's limits, or without data where
// the type has none. Empty where there is none.
std::string what_type_loses(const Volume& volume, ScalarType type);

} // namespace palpate
