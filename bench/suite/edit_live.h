#pragma once

#include <vector>

#include "bench/suite/panel.h"

namespace palpate::bench {

// One long stroke as it is felt and seen: a hand pushes a pose each millisecond along `path_mm`
// for `seconds`, the editor's thread cuts a ball of radius 10 samples, one thread meshes what
// changed, and this one draws pictures of the interactive mode, one after the other. How long after
// the hand each of them had it, and by how many snapshots the hand was ahead of the picture.
Result<Json> edit_live(Bench& bench, const Volume& volume, const Scene& scene,
                       const std::vector<glm::dvec3>& path_mm, double seconds);

} // namespace palpate::bench
