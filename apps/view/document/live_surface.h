#pragma once

#include <optional>

#include "engine/scene/scene.h"

namespace palpate::view {

// How the 3D view shows the volume: by rays, by its surface at the iso-value, or both.
enum class SeenAs { rays, mesh, both };
constexpr SeenAs kSeenAs[] = {SeenAs::rays, SeenAs::mesh, SeenAs::both};
const char* name_of(SeenAs seen);
SeenAs seen_as(const Scene& scene);

// Changes a scene to that. The surface is a live one, at `iso`, which follows edits. Rays that go
// are put away, and come again from there. Meshes of the scene stay. A scene without rays, put away
// or not, and one that has as many surfaces as it may, stay as they are: then it returns false.
bool show_as(Scene& scene, SeenAs seen, double iso, std::optional<RayCastLayer>& put_away);

} // namespace palpate::view
