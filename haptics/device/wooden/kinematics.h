#pragma once

#include <array>
#include <glm/glm.hpp>
#include <optional>

// Mechanics of WoodenHaptics and of the first Polhem: a body that turns about the vertical (a), and
// two links whose angles the motors set independently (b from the vertical up, c from the vertical
// down). Lengths in metres, angles in radians, in the device's axes of device.h with the origin in
// the middle of the workspace. Pure functions.
//
// Geometry: the published configurations of the devices' open interface. Which way each encoder
// counts differs between devices that people have built: the owner's checklist shows it.
namespace palpate::haptics::wooden {

using Counts = std::array<int, 3>;
using Angles = std::array<double, 3>; // of a, b, c

struct Geometry {
    const char* name;
    double post_m, upper_m, lower_m; // up to b's axis; the two links
    std::array<double, 3> ratio;     // of a body's angle to its motor's: capstan over drum, signed
    double counts_per_turn = 2000.0; // of a motor
    double torque_nm_per_a = 0.0259; // of a motor
    glm::dvec3 middle_m;             // of the workspace: towards the person, to the right, up
    double max_stiffness_n_per_m, max_force_n = 5.0, max_damping_n_s_per_m = 8.0;
};
extern const Geometry kWoodenHaptics, kPolhem;

Angles angles_of(const Geometry& geometry, const Counts& counts) noexcept;
// The nearest counts. None where one has no place in 16 bits.
std::optional<std::array<int16_t, 3>> counts_of(const Geometry& geometry,
                                                const Angles& angles) noexcept;
glm::dvec3 forward(const Geometry& geometry, const Angles& angles) noexcept;
// The upper link leaning towards the person; none out of reach or on the vertical.
std::optional<Angles> inverse(const Geometry& geometry, glm::dvec3 position_m) noexcept;
// Position by angles: column i is the velocity of the grip for a unit of angle i.
glm::dmat3 jacobian(const Geometry& geometry, const Angles& angles) noexcept;
// The currents of the motors, A, for a force on the hand: by virtual work.
glm::dvec3 currents(const Geometry& geometry, const Angles& angles, glm::dvec3 force_n) noexcept;

} // namespace palpate::haptics::wooden
