#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "engine/scene/scene.h"

namespace palpate {

// A stereo display as it stands before a person: JSON, docs/reference/display-profile.md.
//
// Points are in millimetres from the middle of the screen: right, up, and out of it towards the
// person. A screen that is seen in a mirror is where its image is.
struct DisplayProfile {
    std::string name;
    glm::dvec2 screen_mm{520.0, 325.0};     // width and height of the picture; > 0
    glm::dvec3 eyes_mm{0.0, 0.0, 600.0};    // the middle between the eyes; z > 0
    double eye_separation_mm = 60.0;        // > 0; the eyes lie along the screen's x axis
    std::optional<StereoLayout> layout;     // none: as options say
    bool swap_eyes = false, mirror = false; // StereoSettings, Scene
    // Calibration: where a device's coordinates (mm) lie on these axes. Invertible, last row 0 0
    // 0 1.
    glm::dmat4 screen_from_device{1.0};

    friend bool operator==(const DisplayProfile&, const DisplayProfile&) = default;
};

// Errors name the file, the key, what was expected and what was found.
Result<DisplayProfile> parse_display_profile(std::string_view text, const std::string& name);
Result<DisplayProfile> load_display_profile(const std::filesystem::path& path);

// The placement of the screen in the world: its middle at the camera's target, facing the camera,
// so large that the eyes are as far from it as the camera is. Turning and zooming move the world
// before the screen. World millimetres from those of the profile.
glm::dmat4 world_from_screen(const DisplayProfile& profile, const Camera& camera);

// The camera of the eyes' middle, through the screen that is shown by eye_px pixels of an eye; and
// both eyes about it. A point of the screen's plane has no parallax.
Camera camera_before(const DisplayProfile& profile, const Camera& camera, glm::uvec2 eye_px);
StereoRig rig_before(const DisplayProfile& profile, const Camera& camera);

} // namespace palpate
