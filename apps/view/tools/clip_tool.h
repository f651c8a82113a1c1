#pragma once

#include "apps/view/window/state.h"

namespace palpate::view {

// Clip planes and the crop box, which is six of them, moved by handles while their tab is open.
// Pure, as after() is.

// The part of a plane that lies in the volume's box and on the kept side of all others: a convex
// polygon; empty where there is none.
std::vector<glm::dvec3> clip_outline(const Grid& grid, const std::vector<ClipPlane>& planes,
                                     size_t number);

// The piece of an outline in a slice; nothing where they do not meet.
std::optional<std::pair<glm::dvec3, glm::dvec3>> clip_line(const ViewState& state, const Grid& grid,
                                                           Panel panel, size_t number);

// In slices: the middle of a plane's line moves it, a quarter of the line from there turns it. In
// 3D: the middle of the outline moves it.
struct ClipHandle {
    size_t plane = 0;
    bool turns = false;
    glm::dvec3 at_mm{0.0};
    glm::dvec2 at_px{0.0};
};
std::vector<ClipHandle> clip_handles(const ViewState& state, const Grid& grid, Panel panel);

// False: no handle lies there.
bool press_clip(ViewState& state, const Subject& subject, Panel panel);
// In a slice a plane goes through the point under the pointer; in 3D along its normal to the point
// that is nearest to the pointer's ray. It stays within the volume's box.
void drag_clip(ViewState& state, const Subject& subject, Panel panel);

// A plane through the crosshair that looks at the eye, so that what lies before it goes.
void add_clip_plane(ViewState& state);
// Six planes along the samples, a tenth of the volume from each face.
void set_crop_box(ViewState& state, const Grid& grid);

} // namespace palpate::view
