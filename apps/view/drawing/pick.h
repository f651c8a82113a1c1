#pragma once

#include <optional>

#include "engine/scene/scene.h"

namespace palpate::view {

// Finds the seen point on a ray of a ray-cast picture: iso, the first crossing of the lowest value;
// alpha, where half of the light has been absorbed; MIP, the value that it shows. Live surfaces and
// clip planes count, meshes do not. Steps are half the smallest spacing; an iso-value is found to
// 1/1000 of one. `labels`, or null: a sample of a label that the scene shows is met, too.
std::optional<glm::dvec3> first_seen(const Ray& ray, const Volume& volume, const Scene& scene,
                                     const Volume* labels = nullptr);

} // namespace palpate::view
