#pragma once

#include "haptics/field/algorithm.h"

// Guidance while seeds are placed, curves drawn and planes moved (Nystroem et al., WISH, 2008,
// sections 4 and 4.2; Vidholm & Agmund 2004, section 8): the hand is drawn where it should work and
// can always get away. The print gives aims and motion rules, and no law.
//
// Both algorithms read the distance d(x) in mm from the scene's first field, TouchScene::field[0]
// (engine/segment/guide_field.h makes such volumes), as a cubic spline, and draw the tool along its
// gradient:
//
//     f = -U'(d) grad d,    U'(d) = min(k d, T0)
//
// with k stiffness_n_per_m and T0 yield_n, the largest force; 0: no limit. U(d(x)) is a potential:
// a hand that comes back to where it was has got no energy, up to what sampling in time makes of
// any spring, which the safety chain's passivity controller takes away. damping_n_s_per_m acts
// against motion along the gradient, where k d is below T0.
//
//   guide-inside: d is signed. Where it is 0 or less nothing is felt: the hand is held in an
//   object. guide-onto:   from both sides to where d is 0: an edge, a path of low cost, a plane.
//
// A field that is level far away, cut at a distance, draws nothing there. Beyond its last samples
// but two, d is that of the nearest place within them, and force along that axis is 0. Without a
// field the tool is free; while its bricks are missing, `unknown`.
namespace palpate::haptics {

std::unique_ptr<Algorithm> make_guide_inside();
std::unique_ptr<Algorithm> make_guide_onto();

} // namespace palpate::haptics
