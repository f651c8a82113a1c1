#pragma once

#include <glm/glm.hpp>

namespace palpate {

// The placement of a volume's samples in the patient.
//
// Index space counts samples: the centre of sample (i, j, k) is at exactly (i, j, k), so the
// sampled box runs from 0 to size - 1 on each axis. World space is millimetres in the patient's
// left-posterior-superior axes (DICOM PS3.3 C.7.6.2). Memory order: x fastest, then y, then z.
struct Grid {
    glm::uvec3 size{1};             // samples on each axis; every component >= 1
    glm::dmat4 world_from_index{1}; // affine, invertible; carries spacing, direction and origin

    friend bool operator==(const Grid&, const Grid&) = default;
};

// A grid whose axes are the world's: origin_mm is the centre of sample (0, 0, 0).
Grid make_grid(glm::uvec3 size, glm::dvec3 spacing_mm, glm::dvec3 origin_mm = {});

// Distance between the centres of neighbouring samples along each index axis; > 0.
glm::dvec3 spacing_mm(const Grid& grid);

glm::dmat4 index_from_world(const Grid& grid); // the inverse of world_from_index

// Number of samples; 64 bits, because three 32-bit sizes multiply.
inline uint64_t sample_count(const Grid& grid) {
    return uint64_t{grid.size.x} * grid.size.y * grid.size.z;
}

glm::dvec3 world_point(const Grid& grid, glm::dvec3 index);    // of a place between samples, too
glm::dvec3 index_point(const Grid& grid, glm::dvec3 world_mm); // the inverse

// The centre of the sampled box, in world millimetres.
glm::dvec3 center_mm(const Grid& grid);

// The gradient in world space of a gradient measured by differences of neighbouring samples.
// gradient_index is in value units per sample; the result is in value units per millimetre.
// Gradients are covectors: they take the inverse transpose, so unequal spacing turns them rightly.
glm::dvec3 world_gradient(const Grid& grid, glm::dvec3 gradient_index);

} // namespace palpate
