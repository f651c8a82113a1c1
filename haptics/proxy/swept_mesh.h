#pragma once

#include "haptics/field/algorithm.h"

namespace palpate::haptics {

// The most triangles that a tick of swept-mesh or swept-local looks at, together with the points
// that it makes of a window. Loops over looks end then, at a place that is free. One takes 12 to 19
// ns, all of them 0.2 to 0.3 ms, of 0.5 that a tick has.
constexpr int64_t kMostLooks = 1 << 14;

// Makes a TouchMesh with cells of about `grain_mm`, or of three mean edges, if that is less; larger
// where there would be more than 2^22. Not for the servo thread.
std::shared_ptr<const TouchMesh> make_touch_mesh(std::shared_ptr<const Mesh> mesh, double grain_mm);

// The surface of a volume as it is felt with these parameters: marching cubes of the sharp view of
// a Field (field.h), on a lattice up to four times as fine as the samples, of 2^26 points at most,
// with normals of the smooth view; closed, because space beyond a volume is free. Not for the servo
// thread.
Mesh touch_surface(const Volume& volume, const TouchParameters& parameters);

// Keeps that surface up to date while the volume is edited, as triangles of one mesh whose blocks
// of 8^3 points of the lattice share no vertices. After an edit the points that read a changed
// sample are made again, and the blocks that read a changed point; what is left is copied. For one
// thread at a time, and not the servo's.
class TouchSurface {
 public:
    TouchSurface(const Volume& volume, const TouchParameters& parameters);
    ~TouchSurface();
    // The next snapshot, of the same size and type. Returns how many blocks were meshed again.
    size_t follow(const Volume& after);
    std::shared_ptr<const TouchMesh> mesh() const; // ready to be felt
    const Volume& volume() const;                  // that it has followed to

 private:
    struct State;
    std::unique_ptr<State> state_;
};

// A point held out of scene.touch_mesh, whatever its speed: met and slid over as in rest.h, with
// force shading, felt on triangles that bulge. Friction, yielding and exchange of the mesh as in
// swept_point.h.
std::unique_ptr<Algorithm> make_swept_mesh();

// The same on the marching-cubes surface of 9x9x9 points about the proxy (FineSamples), made anew
// in the tick and along the way: the repair of Koerner et al. There is no rim to reach, so nothing
// is shifted, and edits and transfer functions are felt in the tick that sees them.
std::unique_ptr<Algorithm> make_swept_local();

} // namespace palpate::haptics
