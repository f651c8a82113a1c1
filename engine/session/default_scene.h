#pragma once

#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/io/scene_data.h"
#include "engine/scene/scene.h"

// The default scene of a volume.
namespace palpate {

// The value of 0 HU in a CT: 0, or 1024 where it lacks its offset (engine/io/hounsfield.h).
double zero_hu(const LoadedScene& loaded);

// "HU" where the values are Hounsfield units; empty else, also where a CT lacks its offset.
std::string value_unit(const LoadedScene& loaded);

// The iso-values of bone and of skin: 300 and -300 HU, in the values of the volume. Nothing where
// it is not a CT: one by its modality, or, where it states none, by its values
// (ValueSurvey::like_hounsfield).
std::optional<double> bone_value(const LoadedScene& loaded);
std::optional<double> skin_value(const LoadedScene& loaded);

// Whether the values are numbers of labels, by what they look like.
bool is_label_map(const LoadedScene& loaded);

// The plane of a volume that is one sample thick; nothing for others.
std::optional<SliceLayer> only_slice(const Grid& grid);

// A ray-cast layer that suits the volume (docs/reference/scene.md, "Defaults for a volume"):
// presets in HU for CT, stretched over the values' range else; where the background is bright, dark
// values are looked for (bright_background.h), and where small values are meant to be bright in
// data without Hounsfield units. The opacity of presets is by the volume's size.
RayCastLayer default_ray_cast(RayMode mode, const LoadedScene& loaded);

// Grey for slices: the soft-tissue window for CT where that shows its values, their range else;
// black and white are exchanged where small values are meant to be bright.
TransferFunction default_slice_transfer(const LoadedScene& loaded);

// Black, red, yellow, white over the values' range, for a volume over slices: the lowest tenth can
// be seen through, what lies above the lowest third is opaque.
TransferFunction default_fusion_transfer(ValueRange range);

// A preset as it suits the volume: `mr` is stretched over the values' range, others are moved to
// where a CT has its 0 HU; opacity is by the volume's size.
TransferFunction fitted(TransferFunction function, const std::string& preset_name,
                        const LoadedScene& loaded);

// Colours that differ from those before: of bone, of skin, ..
glm::dvec3 surface_color(size_t number);

// Opaque for one value; outer surfaces lighter for several. Sorted by value, equal ones dropped.
std::vector<IsoSurface> iso_surfaces(std::vector<double> values);

// A lone slice is looked at straight, as radiologists do (the patient's right on the left, the nose
// up or to the left); else an oblique view, which what can be seen of the volume fills.
Camera default_camera(const Scene& scene, const SceneData& data);

struct ViewDirection {
    glm::dvec3 towards; // from the volume to the eye, LPS
    glm::dvec3 up;
};
std::optional<ViewDirection> view_direction(const std::string& name);
std::vector<std::string> view_names();

} // namespace palpate
