#pragma once

#include "haptics/field/algorithm.h"

namespace palpate::haptics {

// A point proxy on grey values or labels, at any speed: the repair of the point algorithms that the
// five papers print.
//
// The proxy moves along paths that are swept (sweep.h), so contact depends on the proxy's way and
// never on where the tool is: nothing that the grid resolves is passed through. On the surface it
// rests where the tool's displacement is along the smoothed field's normal and the sharp field is
// at its iso-value, found by lifted tangential steps with a secant step length; a bump that the way
// to the tool meets although that lies above the surface is stepped over. Then, in mm:
//
//   friction   Coulomb, static until the proxy moves and dynamic while it does, on the normal force
//              that is rendered
//   yielding   above yield_n the proxy enters the material, and force stays at yield_n
//              (yielding.h); a tool that retreats is not pulled back
//   edits      a snapshot, an iso-value or a source that moves the surface moves what is rendered
//              by at most 90 N/s worth of spring beyond the tool's own motion; then by as much a
//              tick
//   labels     the blurred border of all labels; stiffness, friction and yield_n are means of the
//              labels about the proxy, weighted by a cubic B-spline, so they change smoothly where
//              labels meet
//   confidence where the field is nearly flat the last normal is kept and the force fades
//   slewing    stiffness, friction and yield_n follow their parameters by 5 % of them each ms
//   viscosity  in what is entered, viscosity_n_s_per_m times the velocity
//   vibration  while material is removed, band-limited to 20 - 400 Hz
//
// A tool that starts in material is pushed out where a surface is within 4 samples; else it is
// `submerged` and feels nothing until it is free. Where samples that the surface at the proxy is
// made of have no data or are not in memory, the output is `unknown`: the spring goes along with
// the hand and fades by 90 N/s. Until it has faded, contact goes on where it was as soon as that is
// known; then the proxy is at the hand, as if it started there, and force comes by 90 N/s.
std::unique_ptr<Algorithm> make_swept_point();

} // namespace palpate::haptics
