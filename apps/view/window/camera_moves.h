#pragma once

#include <glm/glm.hpp>

#include "engine/scene/scene.h"

// Moves of a camera by a mouse, in pixels of a view; y points down.
namespace palpate::view {

glm::dvec3 turned(glm::dvec3 v, glm::dvec3 axis, double radians);

// Turns the eye about the target: what is near the eye follows the hand.
void rotate(Camera& camera, glm::dvec2 by_px, glm::dvec2 size_px);
// Turns the picture about the middle of the view, from which both places are counted.
void roll(Camera& camera, glm::dvec2 from_px, glm::dvec2 to_px);
void pan(Camera& camera, glm::dvec2 by_px, glm::dvec2 size_px);
// So many times nearer; extent_mm of the volume bounds the distance.
void zoom(Camera& camera, double times, double extent_mm);

} // namespace palpate::view
