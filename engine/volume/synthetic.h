#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>

#include "engine/volume/volume.h"

// Fields with a known answer, for tests, benchmarks and demonstrations.
//
// Positions and lengths are world millimetres. Values are exact functions evaluated in double, and
// the gradients are their derivatives, not differences. Fields marked "portable" use nothing but
// + - * / and square roots, and so give the same bits on every machine; the others call sin, cos,
// exp or erf, whose last bit belongs to the C library.
namespace palpate::synthetic {

// Both functions may be called from several threads.
struct Field {
    std::function<double(glm::dvec3 mm)> value;
    std::function<glm::dvec3(glm::dvec3 mm)> gradient; // value units per millimetre
};

// offset + dot(slope, mm). Portable.
Field ramp(glm::dvec3 slope_per_mm, double offset = 0.0);

// `inside` between two parallel planes thickness_mm apart, `outside` beyond, with error-function
// edges: the box profile blurred by a Gaussian of edge_sigma_mm > 0. normal has any length but 0.
Field slab(glm::dvec3 center_mm, glm::dvec3 normal, double thickness_mm, double edge_sigma_mm,
           double inside = 1000.0, double outside = 0.0);

// Signed distance to a sphere in mm, positive inside. The gradient at the centre is taken as 0.
// Portable.
Field sphere_distance(glm::dvec3 center_mm, double radius_mm);

// `inside` within a sphere, `outside` beyond, with an error-function edge across the radius.
Field sphere(glm::dvec3 center_mm, double radius_mm, double edge_sigma_mm, double inside = 1000.0,
             double outside = 0.0);

// Signed distance to a torus about the z direction, positive inside: tube_mm is the radius of the
// tube, ring_mm that of its centre line. Portable.
Field torus(glm::dvec3 center_mm, double ring_mm, double tube_mm);

// sin X cos Y + sin Y cos Z + sin Z cos X, with X = 2 pi x / period_mm: between -1.5 and 1.5.
Field gyroid(double period_mm);

// peak * exp(-r^2 / (2 sigma^2)).
Field gaussian(glm::dvec3 center_mm, double sigma_mm, double peak = 1000.0);

// The test signal of Marschner & Lobb (Visualization 1994) with f_M = 6, alpha = 0.25: values
// 0 .. 1 in the cube of half side half_side_mm about the origin, where it is at home on a grid of
// about 40 samples a side.
Field marschner_lobb(double half_side_mm);

// Concentric shells: (1 + cos(2 pi r / period_mm)) / 2.
Field shells(glm::dvec3 center_mm, double period_mm);

// A sheet of Gaussian profile, to be tilted and thinner than a sample: peak * exp(-d^2 / (2
// sigma^2)), d the distance to the plane.
Field thin_sheet(glm::dvec3 point_mm, glm::dvec3 normal, double sigma_mm, double peak = 1000.0);

// Labels 0 .. count - 1 in cubes of cell_mm; neighbouring cubes differ. The gradient is 0.
// Portable.
Field checkerboard(double cell_mm, uint32_t count = 2);

// A head-like CT phantom in HU about the origin, within x +-75, y +-95, z +-85 mm: air -1000,
// scalp 40, a bone shell 6 % thick of 1100, brain 35, and three vessels of 320 and 1.5 to 3 mm
// radius: a straight one along z, a tilted one, and a ring. Edges are polynomial, 1.5 mm wide.
// Portable.
Field ct_phantom();

// Nearly normal noise of mean 0 and variance 1, a function of index and seed alone: the sum of 12
// uniform numbers, so never beyond +-6. Portable.
double noise(glm::uvec3 index, uint64_t seed);

// The field at the samples of a grid, rounded and clamped as make_volume() does, with noise of
// noise_sigma (in value units) added before rounding.
Volume sample(const Field& field, const Grid& grid, ScalarType type, double noise_sigma = 0.0,
              uint64_t seed = 1);

constexpr double kCtNoise_hu = 12.0; // standard deviation of the phantom's noise

// ct_phantom() as a scanner would store it: i16 with 12 HU of noise. The same bytes everywhere.
Volume sample_ct_phantom(const Grid& grid, uint64_t seed = 1);

} // namespace palpate::synthetic
