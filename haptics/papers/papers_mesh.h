#pragma once

#include "haptics/field/algorithm.h"

// The two papers that touch a marching-cubes surface, as printed; see papers.h.
namespace palpate::haptics {

// Koerner et al. 1999: an intermediate local surface of 7x7x7 samples about the tool, made by
// another thread while the servo runs: here it is ready surface_delay_s after it was asked for, of
// the snapshot of that moment. parameters.opacity is applied to samples first. Within the surface a
// point proxy with shaded force, friction and damping. At the rim the object is dragged along with
// the tool; when the new surface comes it is put back at once and the contact is sought anew: the
// force jumps by up to stiffness times the shift.
std::unique_ptr<Algorithm> make_koerner_1999();

// "A haptic rendering algorithm for drilling into volume data": the contact point of Ho & Basdogan
// on the marching-cubes mesh (closest triangle of its cell and the adjacent ones, mean-filtered),
// and drilling in three steps: (1) track until the tool is drill_threshold_mm deep; (2) material is
// being removed where the tool is (the output says `yielding`, and Carving::at_tool), and the point
// is dragged behind the tool's motion at that distance; (3) when it touches a triangle of a newer
// snapshot, track again with a force of stiffness times threshold. Read literally, nothing ends
// step 2 where there is no triangle, and a tool that turns back turns the force round.
std::unique_ptr<Algorithm> make_drill_three_step();

} // namespace palpate::haptics
