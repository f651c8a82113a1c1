#pragma once

#include "engine/scene/scene.h"

namespace palpate {

// Fails where a function cannot be asked for its values: no colour or no opacity, points that are
// not sorted or not finite, opacities beyond 0 .. 1, a unit that is not above 0.
Result<void> check_transfer_function(const TransferFunction& function);

// Refuses a picture that needs more memory than there is (expect_memory()), before anything of it
// is allocated. size_px is of one eye; limit_bytes 0: three quarters of the machine's.
Result<void> expect_picture_memory(glm::uvec2 size_px, int eyes, uint64_t limit_bytes = 0);

// Fails where a scene and its data cannot be drawn together: no layer or no pixels; a camera
// without a direction; planes without a normal; labels or meshes in one of the two alone; more
// slices, clip planes, surfaces or iso-values than the scene's maxima; iso-values that fall; a
// surface depth out of range; labels that are not u8 or u16; and what check_transfer_function() and
// check_steps() and expect_picture_memory() refuse. A sentence that begins with "a scene: ", or
// theirs.
Result<void> check_drawable(const Scene& scene, const SceneData& data);

} // namespace palpate
