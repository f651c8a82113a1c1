#pragma once

#include "haptics/field/algorithm.h"

namespace palpate::haptics {

// A tool of thousands of sample points held out of grey values or labels: the repair of the sampled
// sphere of Vidholm & Agmund.
//
// The tool is the points of scene.tool, or parameters.tool_samples points on a sphere of
// tool_radius_mm. It moves in steps of at most half the smallest spacing, so no sample can jump a
// wall of 1.5 voxels, and leaps over what block ranges call clear. A sample that is in material or
// nearly so, or a place that held the tool a moment ago, is a contact: its clearance is (iso -
// value) / slope along the smoothed normal there, at both of which the sharp field is asked; in
// noise half of it is the smooth field. On a sphere a contact is no sample but a place: it follows
// the surface to where it faces it, as long as no other is there. Contacts are reduced to the
// deepest of each of 24 directions. On grey values the place where a ball is pushed is one, too,
// and it is the one that holds the ball: a sample beside it does so only where it is deep, so that
// the force does not jump from one to the next. The tool's next place is the one nearest to the
// hand that all of them leave free: a quadratic program in three unknowns (planes.h), solved to
// convergence within the tick; along the surface it goes as far as the last steps there have shown
// to be worth going. So samples that press against each other in a groove hold instead of
// cancelling, and whatever sank in is pushed out again, before anything else.
//
// A tick's work is bounded in time (ToolContacts::kMostWork), not in distance: a hand of 3 m/s is
// followed over samples of 0.5 mm within half of it. Where work ends on the way, the tool goes back
// to the last place that was seen not to be in material; a spring that this makes longer is felt no
// stronger, fades within 20 ms, and the contact is `behind` until the tool has followed.
//
// The tool turns with the hand; the torque is that of the contacts' forces about its origin.
// Friction, yielding, edits and labels are as in swept_point.h. Where every sample in material is
// so deep that the field has no slope, the last normal holds; where there is none, or where it
// was half a sample or more in material for 0.1 s after a start or an edit, the tool is `submerged`
// until none of it is. Where contacts that push it are made of samples without data, it is
// `unknown`, as a point is; after a gap without force until it rests on samples with data, but no
// longer than 0.1 s beyond it. While nothing changes but the hand, it lengthens the spring by no
// more than contacts may err (proxy_account.h).
std::unique_ptr<Algorithm> make_swept_tool();

} // namespace palpate::haptics
