#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>

#include "engine/base/json_value.h"
#include "engine/session/iso_list.h"

namespace palpate {

// Where a person was at the last save; a part of the project, and nothing that is undone.
struct Kept {
    std::optional<glm::dvec3> crosshair_mm{}; // where slices were at the last save; world
    std::optional<double> tool_radius_mm{};   // of the window's tool at the last save; > 0
    std::optional<uint16_t> tool_label{};     // that it drew; 1 .. 65535
    IsoList isos{};                           // of the window at the last save

    friend bool operator==(const Kept&, const Kept&) = default;
};

// Its members under their names, those that are not empty.
Json kept_json(const Kept& kept);
// Reads it from an object that may have other members.
Kept read_kept(const JsonValue& in);

} // namespace palpate
