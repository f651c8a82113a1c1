#pragma once

#include <optional>

#include "engine/render/display_layout.h"
#include "engine/scene/display_profile.h"

namespace palpate::view {

struct ViewState;
struct Subject;
enum class Panel;

// How both eyes see the volume's view. A value.
struct StereoView {
    bool on = false;
    StereoLayout layout = StereoLayout::anaglyph; // any but separate
    bool swap_eyes = false, mirror = false;
    // As shares of the camera's distance: between the eyes, and where both see the same pixel.
    double separation = 1.0 / 30.0, convergence = 1.0;
    std::optional<DisplayProfile> profile; // decides on both, on angle and on aspect

    friend bool operator==(const StereoView&, const StereoView&) = default;
};

// As a scene asks, for the camera that the view begins with; or a profile.
StereoView stereo_view_of(const Scene& scene, const Camera& camera);
void use_profile(StereoView& stereo, const DisplayProfile& profile);

// One eye's picture in a view of this size: layouts with both eyes beside each other have half of
// it, and pixels twice as wide or high.
glm::uvec2 eye_size_px(const StereoView& stereo, glm::uvec2 view_px);

// Gives the scene of the volume's view, whose size is the view's, its eyes.
void show_to_both_eyes(Scene& scene, const StereoView& stereo);

// How a view's picture is laid out for the screen, with the crosshair and the 3D cursor as marks of
// either eye. screen_px: of the window's first pixel on the screen.
DisplayLayout display_of(const ViewState& state, Panel panel, glm::ivec2 screen_px);

// The ray under a pixel of the volume's view, in the window's pixels: the one of the eyes' middle.
Ray ray_under(const ViewState& state, glm::dvec2 at_px);

// After a move: the 3D cursor lies on what is seen under the pointer, else as far as the target. It
// is there in stereo, and over the volume's view alone.
void move_cursor(ViewState& state, const Subject& subject);

} // namespace palpate::view
