#pragma once

#include <array>
#include <glm/glm.hpp>
#include <optional>
#include <string>

#include "apps/view/window/panel.h"
#include "engine/annotate/measure.h"
#include "engine/scene/camera.h"
#include "engine/volume/grid.h"

namespace palpate::view {

// How a slice is looked at. The three vectors are orthonormal, right x up = towards; the plane goes
// through the crosshair.
struct SliceView {
    glm::dvec3 right{}, up{}, towards{}; // of the picture; towards the eye
    glm::dvec3 center_mm{0.0};           // that is the picture's middle, seen along `towards`
    double zoom = 1.0;                   // 1: the whole volume just fits

    friend bool operator==(const SliceView&, const SliceView&) = default;
};

// Axial, coronal and sagittal: along the axes of the samples that are nearest to those of the
// patient, made orthogonal where the grid is sheared. Axial slices are seen from the feet, coronal
// ones from the front, sagittal ones from the left.
std::array<SliceView, kSlicePanels> slice_views(const Grid& grid);

// The point of the view's plane through the crosshair that lies before the view's middle, to 1e-9
// mm: one and the same wherever in the plane the crosshair is, so that a slice is not drawn anew.
glm::dvec3 point_of_plane(const SliceView& view, glm::dvec3 crosshair_mm);

// An orthographic camera on the plane through the crosshair, for a panel of this size.
Camera camera_of(const SliceView& view, glm::dvec3 crosshair_mm, const Grid& grid,
                 glm::ivec2 size_px);

// The point of the plane under a pixel of the panel (its middle lies at the pixel's middle).
glm::dvec3 point_under(const SliceView& view, glm::dvec3 crosshair_mm, const Grid& grid,
                       glm::ivec2 size_px, glm::dvec2 pixel);
// The pixel whose middle shows a point, seen along `towards`.
glm::dvec2 pixel_of(const SliceView& view, const Grid& grid, glm::ivec2 size_px,
                    glm::dvec3 point_mm);
double mm_per_px(const SliceView& view, const Grid& grid, glm::ivec2 size_px);

// The pixel in a view, or in a camera's own; nothing where the point is not in front of the eye.
std::optional<glm::dvec2> pixel_of(const View& view, glm::ivec2 size_px, glm::dvec3 point_mm);
std::optional<glm::dvec2> pixel_of(const Camera& camera, glm::ivec2 size_px, glm::dvec3 point_mm);

// The way along a direction of unit length from one layer of samples to the next.
double layer_step_mm(const Grid& grid, glm::dvec3 direction);

// A place in the patient by its sides, in mm: "L 12.4  P 88.0  S 262.3 mm". On a plane between two
// sides it is at 0 of the left, the back or the head.
std::string patient_text(glm::dvec3 point_mm);

} // namespace palpate::view
