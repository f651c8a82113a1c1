#pragma once

#include <array>
#include <glm/glm.hpp>

#include "engine/volume/grid.h"

namespace palpate {

enum class Projection { perspective, orthographic };

// Position and projection of the viewer, in world millimetres.
struct Camera {
    Projection projection = Projection::perspective;
    glm::dvec3 eye_mm{0.0, -500.0, 0.0};
    glm::dvec3 target_mm{0.0};     // the centre of the picture; differs from eye_mm
    glm::dvec3 up{0.0, 0.0, 1.0};  // any length; not parallel to the view direction
    double view_angle_deg = 30.0;  // perspective: whole angle from bottom to top; 0 < angle < 180
    double view_height_mm = 200.0; // orthographic: height of what is seen; > 0
    double pixel_aspect = 1.0;     // a pixel's width by its height; > 0
    // The offset of the picture's middle from the view direction, right and up, in halves of its
    // height, as for a screen that the eye is not in front of.
    glm::dvec2 shift{0.0};

    friend bool operator==(const Camera&, const Camera&) = default;
};

// Two eyes beside the camera's own, looking along parallel axes with shifted (off-axis) frusta, so
// that a point convergence_mm in front of the camera falls on the same pixel for both.
struct StereoRig {
    double eye_separation_mm = 65.0; // > 0
    double convergence_mm = 500.0;   // > 0

    friend bool operator==(const StereoRig&, const StereoRig&) = default;
};

// The rays of one eye's picture, shared by ray caster, slices and reference.
//
// A pixel (x, y), row 0 at the top, has its centre at (x + 0.5, y + 0.5). With u = (x + 0.5) /
// width and v = (y + 0.5) / height, the point of the image plane is
//   a = mix(left, right_edge, u) * right + mix(top, bottom, v) * up.
// Perspective: the ray starts at eye_mm and points along forward + a (the bounds are tangents).
// Orthographic: it starts at eye_mm + a and points along forward (the bounds are millimetres).
// Distances along a ray are millimetres from its start.
struct View {
    Projection projection = Projection::perspective;
    glm::dvec3 eye_mm{};
    glm::dvec3 right{}, up{}, forward{}; // orthonormal: right x up = -forward
    double left = 0, right_edge = 0, bottom = 0, top = 0;
};

struct Ray {
    glm::dvec3 origin_mm;
    glm::dvec3 direction; // unit length
};

// The camera's own view, for a picture of this shape.
View make_view(const Camera& camera, glm::uvec2 size_px);

// Left and right eye.
std::array<View, 2> make_stereo_views(const Camera& camera, const StereoRig& rig,
                                      glm::uvec2 size_px);

// pixel may be fractional: pixel + 0.5 is used as the centre.
Ray ray_through(const View& view, glm::dvec2 pixel, glm::uvec2 size_px);

// A perspective camera that sees the whole sampled box from `direction` (towards the patient's
// left, posterior, superior when positive). fill = 1 touches the sphere round the box, smaller
// comes closer: distance = fill * radius / sin(view_angle / 2).
Camera frame_volume(const Grid& grid, glm::dvec3 direction, glm::dvec3 up, double fill = 0.8,
                    double view_angle_deg = 30.0);

// The camera turned by `degrees` about the axis `up` through its target, counter-clockwise seen
// from the tip of `up`.
Camera orbit(const Camera& camera, double degrees);

} // namespace palpate
