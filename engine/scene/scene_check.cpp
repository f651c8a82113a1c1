#include "engine/scene/scene_check.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "engine/base/memory_limit.h"
#include "engine/scene/scene_settings.h"

namespace palpate {

namespace {

// Bytes a pixel of one eye takes on a device that is the processor, where a picture is in memory as
// images of the device, as they are read back, as floats for its marks and its layout, and as 8
// bits.
constexpr double kPixelBytes = 96.0;
constexpr size_t kAlwaysDrawn_px = size_t{4096} * 4096;

} // namespace

Result<void> check_transfer_function(const TransferFunction& function) {
    if (function.colors.empty() || function.opacities.empty())
        return fail(
            "a transfer function: expected a colour and an opacity at least, found {} and {}",
            function.colors.size(), function.opacities.size());
    const auto check_order = [](const char* what, const auto& points) -> Result<void> {
        for (size_t i = 0; i < points.size(); ++i)
            if (!std::isfinite(points[i].value) || (i > 0 && points[i].value < points[i - 1].value))
                return fail("a transfer function: expected {} whose values do not fall, found {}",
                            what, points[i].value);
        return {};
    };
    PALPATE_TRY(check_order("colours", function.colors));
    PALPATE_TRY(check_order("opacities", function.opacities));
    for (const auto& point : function.opacities)
        if (!(point.opacity >= 0.0 && point.opacity <= 1.0))
            return fail("a transfer function: expected opacities of 0 .. 1, found {}",
                        point.opacity);
    if (!(function.opacity_unit_mm > 0.0))
        return fail("a transfer function: expected an opacity unit above 0 mm, found {}",
                    function.opacity_unit_mm);
    return {};
}

Result<void> expect_picture_memory(glm::uvec2 size_px, int eyes, uint64_t limit_bytes) {
    const double pixels = static_cast<double>(size_px.x) * size_px.y * eyes;
    const std::string what = fmt::format("a picture of {} x {} pixels{}", size_px.x, size_px.y,
                                         eyes > 1 ? " for each of two eyes" : "");
    return expect_memory(what, pixels * kPixelBytes, limit_bytes);
}

Result<void> check_drawable(const Scene& scene, const SceneData& data) {
    if (!scene.ray_cast && scene.slices.empty() && scene.surfaces.empty())
        return fail("a scene: expected a ray cast, a slice or a surface, found none");
    if (scene.size_px.x == 0 || scene.size_px.y == 0)
        return fail("a scene: expected one pixel or more, found {} x {}", scene.size_px.x,
                    scene.size_px.y);
    if (size_t{scene.size_px.x} * scene.size_px.y > kAlwaysDrawn_px) // asked for every frame
        PALPATE_TRY(expect_picture_memory(scene.size_px, scene.stereo ? 2 : 1));
    const glm::dvec3 forward = scene.camera.target_mm - scene.camera.eye_mm;
    const double sine = glm::length(glm::cross(forward, scene.camera.up)) /
                        (glm::length(forward) * glm::length(scene.camera.up));
    if (!(sine > 1e-6))
        return fail(
            "a scene: expected a camera whose direction is not along its up, found both parallel "
            "or 0");
    for (const auto& [name, in_scene, in_data] :
         {std::tuple("labels", scene.labels.has_value(), data.labels.has_value()),
          {"fused values", scene.fusion.has_value(), data.fused.has_value()},
          {"overlay labels", scene.overlay.has_value(), data.overlay.has_value()}})
        if (in_scene != in_data)
            return fail("a scene: expected {} in the scene and in its data, found them in {} alone",
                        name, in_scene ? "the scene" : "the data");
    for (const auto* labels : {&data.labels, &data.overlay})
        if (*labels && (*labels)->type() != ScalarType::u8 && (*labels)->type() != ScalarType::u16)
            return fail("a scene: expected labels of type u8 or u16, found {}",
                        name_of((*labels)->type()));
    if (scene.fusion)
        if (Result<void> good = check_transfer_function(scene.fusion->transfer); !good)
            return good;
    const size_t isos = scene.ray_cast ? scene.ray_cast->isos.size() : 0;
    for (const auto& [name, found, most] :
         {std::tuple("slices", scene.slices.size(), kMaxSlices),
          {"clip planes", scene.clip_planes.size(), kMaxClipPlanes},
          {"surfaces", scene.surfaces.size(), kMaxSurfaces},
          {"iso-values", isos, kMaxIsos}})
        if (found > most)
            return fail("a scene: expected at most {} {}, found {}", most, name, found);
    const auto is_plane = [](const auto& plane) {
        const double length = glm::length(plane.normal);
        return length > 0.0 && std::isfinite(length);
    };
    if (!std::all_of(scene.slices.begin(), scene.slices.end(), is_plane) ||
        !std::all_of(scene.clip_planes.begin(), scene.clip_planes.end(), is_plane))
        return fail(
            "a scene: expected slices and clip planes with a normal, found one of length 0");
    if (data.meshes.size() != scene.surfaces.size())
        return fail("a scene: expected {} meshes, one for each surface, found {}",
                    scene.surfaces.size(), data.meshes.size());
    for (size_t i = 0; i < scene.surfaces.size(); ++i)
        if (!data.meshes[i] && !scene.surfaces[i].live_iso && !scene.surfaces[i].live_labels)
            return fail("a scene: expected a mesh for surface {}, found none", i + 1);
    PALPATE_TRY(check_settings<Scene>("a scene", scene, kSceneSettings));
    if (!scene.slices.empty())
        PALPATE_TRY(check_transfer_function(scene.slice_transfer));
    if (!scene.ray_cast)
        return {};
    const RayCastLayer& layer = *scene.ray_cast;
    PALPATE_TRY(check_settings<RayCastLayer>("a scene", layer, kRayCastSettings));
    for (size_t i = 1; i < layer.isos.size(); ++i)
        if (!(layer.isos[i - 1].value < layer.isos[i].value))
            return fail("a scene: expected iso-values that rise, found {} after {}",
                        layer.isos[i].value, layer.isos[i - 1].value);
    if (layer.mode != RayMode::iso)
        PALPATE_TRY(check_transfer_function(layer.transfer));
    return check_steps(layer, data.volume.grid());
}

} // namespace palpate
