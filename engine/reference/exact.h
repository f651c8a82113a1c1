#pragma once

#include "engine/reference/cubic.h"
#include "engine/reference/march.h"

namespace palpate::reference {

// The ray caster's `exact` integrator in double. `table` belongs to layer.transfer.
//
// A ray is cut at the faces of cells (and of label voxels where there are labels), each cut derived
// from the integer number of its face; between two cuts the trilinear field is one cubic.
//   alpha  the cubic's values at the ends of 1 .. layer.sub_steps pieces, looked up in the table's
//          running integrals; shaded at the middle of each
//   iso    each root of the cubic: none missed, one on a face met once
//   mip    the largest value of the cubic
// A cell with a corner without data is left out.
class ExactMarcher {
 public:
    // All must outlive it.
    ExactMarcher(const RayCastLayer& layer, const TransferTable& table, const Volume& volume,
                 const Rays& rays, Sampler& sampler);

    // `t` is not empty.
    Marched march(const LocalRay& ray, Stretch t);

 private:
    struct Piece; // the ray's part in one cell
    template <class Visit>
    void for_each_piece(const LocalRay& ray, Stretch t, Visit&& visit);

    Marched march_alpha(const LocalRay& ray, Stretch t);
    Marched march_iso(const LocalRay& ray, Stretch t);
    Marched march_mip(const LocalRay& ray, Stretch t);
    double pieces_of(const Cubic& cubic) const;

    const RayCastLayer& layer_;
    const TransferTable& table_;
    const Volume& volume_;
    const Rays& rays_;
    Sampler& sampler_;
    double detail_;
};

} // namespace palpate::reference
