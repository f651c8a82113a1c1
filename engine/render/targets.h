#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/scene/scene.h"

namespace palpate {

// The colour of a ray that meets nothing.
glm::vec4 color_of_nothing(const Scene& scene);

uint32_t eye_count(const Scene& scene);
uint32_t all_eyes(const Scene& scene);          // bit e: eye e
std::vector<View> views_of(const Scene& scene); // one an eye
glm::uvec2 tile_count(glm::uvec2 rays);         // of gpu::kTileSide

// The images that a view's frame is drawn into, one layer an eye; what its scene does not need is
// not there.
struct Targets {
    // `see_through`: some of the scene's meshes are.
    Targets(GpuDevice& device, const Scene& scene, bool see_through);
    // Whether they are the same as for another scene.
    bool suit(const Scene& scene, bool see_through) const;

    glm::uvec2 size_px;
    uint32_t eyes;
    bool return_values;                            // the scene asks for value and depth
    std::optional<GpuImage> color, values;         // what is read back
    std::optional<GpuImage> behind, behind_values; // slices and opaque meshes: behind all rays
    std::optional<GpuImage> layers;                // see-through meshes in a ray's way

    GpuImage* returned_values() { return return_values ? &*values : nullptr; }
    // Fills the images behind all rays with the background, before anything is drawn there.
    void clear_behind(const Scene& scene, Commands& commands);
    // A picture of what lies behind all rays, for these to be drawn over.
    void record_background(const Scene& scene, Commands& commands);
};

} // namespace palpate
