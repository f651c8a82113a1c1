#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/io/scene_data.h"
#include "engine/scene/scene.h"

// What a volume is shown as when nobody says how.
namespace palpate {

// A ray-cast layer that suits the volume: presets in HU for CT, stretched over the values' range
// else.
RayCastLayer default_ray_cast(RayMode mode, const LoadedScene& loaded);

// Grey for slices: the soft-tissue window for CT, the values' range else.
TransferFunction default_slice_transfer(const LoadedScene& loaded);

// A preset as it suits the volume: `mr` is stretched over the values' range.
TransferFunction fitted(const TransferFunction& function, const std::string& preset_name,
                        const LoadedScene& loaded);

// Colours that differ from those before: of bone, of skin, ..
glm::dvec3 surface_color(size_t number);

// Opaque for one value; outer surfaces lighter for several. Sorted by value, equal ones dropped.
std::vector<IsoSurface> iso_surfaces(std::vector<double> values);

// A lone slice is looked at straight, as radiologists do (the patient's right on the left, the nose
// up or to the left); else an oblique view of the whole volume.
Camera default_camera(const Scene& scene, const Grid& grid);

struct ViewDirection {
    glm::dvec3 towards; // from the volume to the eye, LPS
    glm::dvec3 up;
};
std::optional<ViewDirection> view_direction(const std::string& name);
std::string view_names();

} // namespace palpate
