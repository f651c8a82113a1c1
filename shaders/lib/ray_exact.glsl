// The exact integrator: rays cut at the faces of cells, between which the trilinear field along the
// ray is one cubic. Included by ray_cast.comp where IS_EXACT. Its twin in double is
// engine/reference/exact.h.
//
// Every cut is a function of the whole number of its face and of the ray alone, never a sum of
// steps: wherever a march starts or leaps to, it meets the same cuts, to the bit.
//
// A march has an inner loop to the next piece that may matter to any lane of the subgroup, and does
// what is dear after it. All lanes leave a loop together and keep what they have found by selects:
// llvmpipe of Mesa 22.3 mixes up the iterations of values that are used after a loop which lanes
// leave at different times.
#include "shaders/lib/exact_walk.glsl"
#if IS_ISO
#include "shaders/lib/exact_iso.glsl"
#else
#include "shaders/lib/exact_alpha.glsl"
#include "shaders/lib/exact_mip.glsl"
#endif
