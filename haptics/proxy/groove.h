#pragma once

#include <glm/glm.hpp>
#include <span>

#include "haptics/proxy/tool_hold.h"

namespace palpate::haptics {

// A groove that a tool touches in several places across it: the normals there lie near a plane.
struct Groove {
    glm::dvec3 along{0.0}, across{0.0},
        out{0.0};                         // right-handed unit vectors, `out` of the material
    double low_rad = 0.0, high_rad = 0.0; // range of the normals, from `out` to `across`
    double certainty = 0.0;               // 0: there is none .. 1

    glm::dvec3 normal_at(double angle_rad) const;
    double angle_rad_of(glm::dvec3 normal) const;
};

// Of the holds that are within reach_mm of the surface and face it.
Groove groove_of(std::span<const Hold> holds, double reach_mm);

// Makes what holds a tool in a groove agree with each other.
//
// A ball that fits the rounding of a groove touches it all across, and nothing holds its place
// along it. But each clearance errs a little, and what two nearly opposite flanks err raises the
// ball by many times as much: its crease undulates, it slides into the next dip, and the force
// leans by degrees. So normals are turned into the groove's plane, and clearances are drawn to
// those of the one place of the tool that fits all of them best (least squares). Both the less, the
// farther a hold is from the surface and the more they disagree: where they tell of another shape
// (a corner of three faces, a wider hollow) little is changed.
//
// Holds within reach_mm of the surface, which face it, take part; error_mm is what clearances err
// by. Returns by how much they are drawn: 0 .. 1; nothing is done where there is no groove.
double agree(const Groove& groove, std::span<Hold> holds, double reach_mm, double error_mm);

} // namespace palpate::haptics
