#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>

// The place of a Novint Falcon's grip for given motor angles, and the torques that make a force.
//
// Three legs, each an arm on a motor and a parallelogram: a delta robot with link offsets. Source
// of the equations: R. E. Stamper, A three degree of freedom parallel manipulator with only
// translational degrees of freedom, University of Maryland, 1997; the lengths are those that open
// drivers publish. Space: the device's own, metres, x to the right, y up, z away from its base
// towards the person, origin in the plane of the motors. Angles in radians. Pure functions.
namespace palpate::haptics::falcon {

using Angles = std::array<double, 3>; // of the arms
using Counts = std::array<int16_t, 3>;

// The workspace is a ball about the middle; a cube about it of this half length has corners that
// the legs cannot reach.
constexpr double kCentre_m = 0.125; // z of its middle
constexpr double kReach_m = 0.040;  // its radius
constexpr double kForce_n = 4.8;    // that 0.4096 N m at each motor give anywhere in it
constexpr int kMostCounts = 2300;   // beyond what the arms can turn either way

double angle_of_count(int count) noexcept; // 35 degrees at count 0
double count_of_angle(double angle) noexcept;

// Rows: legs. dg/dp and dg/dangle of the loop equations g(angle, p) = 0, m.
struct LoopGradient {
    glm::dmat3 by_position; // column-major: [column][row]
    glm::dvec3 by_angle;
};
glm::dvec3 loop_error(const Angles& angles, glm::dvec3 position_m) noexcept; // m^2
LoopGradient loop_gradient(const Angles& angles, glm::dvec3 position_m) noexcept;

// Newton's method from `start_m`, the last position or home(); within 1e-12 m. None: the angles
// belong to no place of the grip in front of the base, or the legs are stretched.
std::optional<glm::dvec3> forward(const Angles& angles, glm::dvec3 start_m) noexcept;
constexpr glm::dvec3 home() noexcept {
    return {0.0, 0.0, 0.1};
}
// None: out of reach.
std::optional<Angles> inverse(glm::dvec3 position_m) noexcept;

// A = dp/dangle. None at a singular pose. Virtual work: torque_nm = transpose(A) * force_n.
std::optional<glm::dmat3> jacobian(const Angles& angles, glm::dvec3 position_m) noexcept;

} // namespace palpate::haptics::falcon
