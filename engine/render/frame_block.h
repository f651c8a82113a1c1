#pragma once

#include <vector>

#include "engine/scene/scene.h"
#include "shaders/shared/slices.h"

namespace palpate {

// How values and labels reach the shader.
struct FrameInputs {
    float value_scale = 1, value_bias = 0; // value = texel * scale + bias
    double table_low = 0, table_high = 1;  // value range of the transfer table
    glm::vec4 table_first{}, table_last{}; // its end entries: rgb, tau per mm
    uint32_t style_count = 1;
    glm::uvec3 cells{1};    // macro-cells on each axis
    uint32_t cell_side = 1; // samples
    double cell_margin = 0; // of values
};

// The uniform block of a frame: world and double precision end here. `views` holds one view an eye.
gpu::Frame make_frame_block(const Scene& scene, const SceneData& data, std::span<const View> views,
                            const FrameInputs& inputs);

// The planes of the slice pass, in index space.
std::vector<gpu::SliceIndex> make_slice_planes(const Scene& scene, const Grid& grid);

// Layers over slices (shaders/shared/slices.h): a fused volume whose value is texel * scale + bias,
// through a table over low .. high, and an overlay with so many styles. Layers that the scene lacks
// are left as they are.
struct OverInputs {
    float value_scale = 1, value_bias = 0;
    double table_low = 0, table_high = 1;
    uint32_t style_count = 1;
};
gpu::SliceOver make_slice_over(const Scene& scene, const SceneData& data, const OverInputs& inputs);

// One entry a label: colour, and 1 where it is shown. Entry 0 is background. The last entry serves
// every label beyond.
std::vector<glm::vec4> make_label_styles(const LabelLayer& layer, uint32_t largest_label);

} // namespace palpate
