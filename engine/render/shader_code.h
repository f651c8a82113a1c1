#pragma once

#include <cstdint>
#include <span>

namespace palpate {

// The SPIR-V words of the plainest ray caster, for tools and tests that look into it.
std::span<const uint32_t> ray_cast_shader();
// The same for a volume in a brick atlas.
std::span<const uint32_t> ray_cast_atlas_shader();
// What draws a mesh's triangles.
std::span<const uint32_t> surface_draw_shader();

} // namespace palpate
