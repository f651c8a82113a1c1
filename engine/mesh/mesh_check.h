#pragma once

#include "engine/base/error.h"
#include "engine/mesh/mesh.h"

namespace palpate {

// Fails where attributes are not one a position or one a triangle, where a triangle names a
// position that is not there, or where a position is not finite: all that functions of meshes take
// for granted. The sentence begins with "a mesh: ".
Result<void> check_mesh(const Mesh& mesh);

} // namespace palpate
