#pragma once

#include <span>

#include "engine/scene/camera.h"

namespace palpate {

// A camera on the way from `a` (share 0) to `b` (share 1): the eye turns about the target on the
// shorter way, and comes closer or moves away by equal factors in equal shares; targets, angles and
// up follow in proportion. The projection is that of `a`. At the ends it is `a` and `b`, but for
// `up`, which is made orthogonal to the view.
Camera between(const Camera& a, const Camera& b, double share);

// The camera at a share, 0 .. 1, of the way through all of them, which take equal parts of it. At
// least one.
Camera along(std::span<const Camera> cameras, double share);

} // namespace palpate
