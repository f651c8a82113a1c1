#pragma once

#include <vector>

#include "engine/mesh/mesh.h"

namespace palpate {

// Gives a part the positions (and normals) of `whole` that its triangles use, in their order. Its
// triangles number those of `whole` before and its own after. `renamed` is scratch that calls with
// the same `whole` share: empty at the first, and as large as `whole` once, not once a part.
void take_used_positions(const Mesh& whole, Mesh& part, std::vector<uint32_t>& renamed);

} // namespace palpate
