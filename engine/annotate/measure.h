#pragma once

#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "engine/scene/camera.h"
#include "engine/volume/grid.h"

// The geometry of marks over a picture, for whoever draws them: figures (figure.h) and windows.
namespace palpate {

// The patient's sides that a direction points to: L R P A S I, the strongest first; those that hold
// less than a fifth of it are left out. "L", "LP", "AIR".
std::string letters_of(glm::dvec3 direction);

// A round length (1, 2 or 5 times a power of ten) of at most `most_px` pixels, and more than 2/5 of
// them. Both arguments are above 0.
struct ScaleBar {
    double mm, px;
};
ScaleBar scale_bar(double mm_per_px, double most_px);
std::string length_text(double mm); // "20 mm", "2 m"

// The scale of a camera's picture at right angles to the view direction: the same everywhere for an
// orthographic camera, and that at the distance of the target, the focal plane, for perspective.
double mm_per_px(const Camera& camera, glm::uvec2 size_px);

// Whether planes across a direction hold samples: it stands on two axes of the grid.
bool holds_samples(const Grid& grid, glm::dvec3 direction);

// The place of a plane along the patient's axis that is nearest to its normal: "S 12.5 mm, 46 of
// 108" (the number of the layer of samples), or "S 12.5 mm, turned" where it cuts across layers.
std::string place_text(const Grid& grid, glm::dvec3 point_mm, glm::dvec3 normal);

// A grey window as radiologists write it, width and level: "W 400 L 40".
std::string window_text(double low, double high);

// Round values (1, 2 or 5 times a power of ten apart) within low .. high; low < high. At most
// `most` >= 2 of them, and at least one where most >= 4.
std::vector<double> round_values(double low, double high, int most);

} // namespace palpate
