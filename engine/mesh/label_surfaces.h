#pragma once

#include <functional>

#include "engine/mesh/mesh.h"

namespace palpate {

// The surfaces of all labels, one after another: visit(label, surface_of_label(mesh, label)) for
// every label that has triangles, rising, 0 among them where it is an outer one. Looks at each
// triangle as often as it has labels, whatever their number.
void for_each_label(const Mesh& mesh,
                    const std::function<void(uint16_t label, const Mesh& surface)>& visit);

} // namespace palpate
