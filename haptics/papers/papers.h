#pragma once

#include "haptics/field/algorithm.h"

// The algorithms of five papers as printed, with their faults. Tests named for each fault keep it
// (tests/unit/haptics_proxy/printed_test.cpp); the repaired algorithms are in swept_point.h,
// swept_tool.h and swept_mesh.h.
namespace palpate::haptics {

// Vidholm & Agmund, SIGRAD 2004: a sphere of tool_samples points; the normal is against the mean of
// the points that touch; T0 is yield_n, friction mu is friction_dynamic. By the print's rule P2 a
// T0 of 0 would be no resistance; here, as in every algorithm, yield_n = 0 is never, and a material
// without resistance is one of little T0. What is touched is decided at the nearest sample. A proxy
// that moves into material stays in it, and within material on all sides it has no normal.
std::unique_ptr<Algorithm> make_vidholm_2004();

// Nystroem et al. (WISH), 2008: the frame is the gradient's at the proxy; a motion rule and a
// haptic transfer function of the grey value at the proxy for each axis (parameters.transfer).
//   surface:   unilateral along the normal, bilateral across
//   viscosity: bilateral on all axes
//   potential: directed force along the gradient
//   vector:    directed force along the scene's vector field, or along the gradient without one
// The strength is the print's T0: 0, the default, is no resistance.
// surface-literal keeps the sign of the print, by which a push into material moves the proxy out
// instead of in; Vidholm & Agmund print the sign that the text and figure 3 mean.
std::unique_ptr<Algorithm> make_wish_2008_surface();
std::unique_ptr<Algorithm> make_wish_2008_surface_literal();
std::unique_ptr<Algorithm> make_wish_2008_viscosity();
std::unique_ptr<Algorithm> make_wish_2008_potential();
std::unique_ptr<Algorithm> make_wish_2008_vector();

// Eriksson, Dixon & Wikander, MMVR 2006: touch is decided at the tool; the proxy moves along the
// tangent plane, then in steps of 0.1 samples along the gradient until the surface is crossed (20
// at most), and off it by the tool's radius. White vibration while material is removed. A wall lets
// go once the tool is behind it. Touch is that of the tool's middle, so a tool of radius r, which
// is r deep by then, is met by k r in one tick. eriksson_2006_literal searches the surface along
// the sign of the print, +n in material, which leads deeper; eriksson_2006 towards lower density,
// which is what the text means.
std::unique_ptr<Algorithm> make_eriksson_2006();
std::unique_ptr<Algorithm> make_eriksson_2006_literal();

// The motion rules of one axis: displacement of the proxy for a displacement d of the tool, with
// the strength divided by the stiffness. Lengths in mm.
double unilateral(double d, double yield_mm);            // free outwards, held inwards
double unilateral_as_printed(double d, double yield_mm); // its second branch without the minus
double bilateral(double d, double yield_mm);
double directed(double d, double pull_mm);

} // namespace palpate::haptics
