#pragma once

#include "engine/base/given_settings.h"
#include "engine/scene/scene.h"

// The numbers of a picture that a person may set, described once: the keys of scene files under
// ray_cast, ray_cast.shading and so on, the options of `palpate render`, the keywords of Python,
// what is checked before a picture is drawn, and the table of docs/reference/scene.md.
namespace palpate {

// clang-format off
inline constexpr Setting<RayCastLayer> kRayCastSettings[] = {
    {"step_mm", &RayCastLayer::step_mm, 0, 1e6, "mm",
     "Distance between samples; 0 is the smallest spacing; exact has no steps",
     {.option = "step", .by_default = "half the smallest spacing for alpha, else 0"}},
    {"sub_steps", &RayCastLayer::sub_steps, 1, kMaxSubSteps, "",
     "Maximum sub-steps per voxel cell, of exact in mode alpha; fewer where the field is linear, "
     "more where a sub-step would change the pixel's colour by more than 0.01 / sub_steps^2",
     {.option = "sub-steps"}},
    {"ambient_occlusion_mm", &RayCastLayer::occlusion_mm, 0, 1e6, "mm",
     "Darken what lies in hollows of up to this radius, in mode iso, by 192 more samples a hit; a "
     "cue to depth, not a simulation of light. It also darkens open bone, whose stairs and "
     "roughness count as hollows",
     {.option = "ambient-occlusion", .by_default = "0, none"}},
    {"min_transmittance", &RayCastLayer::min_transmittance, 0, 1, "",
     "Transmittance below which a ray stops: the bound of the error in colour",
     {.option = "min-transmittance", .by_default = "1/1024"}},
};

inline constexpr Setting<Shading> kShadingSettings[] = {
    {"ambient", &Shading::ambient, 0, 10, "", "Weight of ambient light"},
    {"diffuse", &Shading::diffuse, 0, 10, "", "Weight of diffuse light"},
    {"specular", &Shading::specular, 0, 10, "", "Weight of highlights"},
    {"shininess", &Shading::shininess, 0, 1e4, "", "How small highlights are"},
};

inline constexpr Setting<Light> kLightSettings[] = {
    {"azimuth_deg", &Light::azimuth_deg, -180, 180, "degrees",
     "Direction of a light far away, to the right of the viewer"},
    {"elevation_deg", &Light::elevation_deg, -90, 90, "degrees",
     "Direction of that light, up"},
};

inline constexpr Setting<SliceLayer> kSliceSettings[] = {
    {"slab_mm", &SliceLayer::slab_mm, 0, 1e6, "mm", "Thickness of slices; 0 is a plain slice",
     {.option = "slab"}},
};

inline constexpr Setting<LabelLayer> kLabelLayerSettings[] = {
    {"ray_cast_weight", &LabelLayer::ray_cast_weight, 0, 1, "",
     "How far labels tint ray casting"},
    {"slice_opacity", &LabelLayer::slice_opacity, 0, 1, "", "Opacity of labels on slices"},
    {"outline_px", &LabelLayer::outline_px, 0, 100, "pixels",
     "Width of the outline of labels on slices; 0 draws none"},
};

inline constexpr Setting<FusionLayer> kFusionSettings[] = {
    {"opacity", &FusionLayer::opacity, 0, 1, "", "Opacity of the fused volume",
     {.option = "fused-opacity"}},
};

inline constexpr Setting<SurfaceStyle> kSurfaceStyleSettings[] = {
    {"opacity", &SurfaceStyle::opacity, 0, 1, "", "Opacity of a surface, or of its label"},
};

inline constexpr Setting<Scene> kSceneSettings[] = {
    {"surface_depth", &Scene::surface_depth, 1, kMaxSurfaceDepth, "",
     "Maximum number of translucent triangles blended at a pixel: the nearest, exactly; triangles "
     "behind them are left out",
     {.option = "surface-depth"}},
};
// clang-format on

} // namespace palpate
