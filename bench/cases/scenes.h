#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "bench/cases/findings.h"
#include "bench/cases/painter.h"

// Building blocks of the hard cases.
namespace palpate::cases {

// fp32 places on a ray: 100 mm from the eye they are 2^-18 mm apart, and a sum of three products
// may be off by twice that.
constexpr double kPlaceMm = 1e-5;

// A picture with a known answer.
struct Case {
    std::string name;
    Scene scene;
    SceneData data;
    std::function<void(const Image&, Findings&)> check;
};
void run_all(const std::vector<Case>& cases, Painter& painter, Findings& findings,
             const Choices& choices = {});

// Scenes whose pictures must agree: no channel of R, G, B, A may differ by more than
// max_difference. 0 means the same bits.
struct Same {
    std::string name;
    std::vector<std::pair<Scene, SceneData>> variants;
    double max_difference;
};
void run_all(const std::vector<Same>& cases, Painter& painter, Findings& findings);

// How far apart two pictures of one shape are at most; NaN in one alone counts as infinity, NaN in
// both as equal.
double largest_difference(const Image& a, const Image& b);

// All integrators, and their names.
std::vector<Integrator> integrators();
const char* name_of(Integrator integrator);

// One opacity for every value.
TransferFunction constant(double tau_per_mm, double unit_mm = 1.0,
                          glm::dvec3 color = glm::dvec3(1.0));

// Extinction tau per mm and unit of value, for values between 0 and 1. A transfer function is
// linear in the opacity, so this takes many points on the curve.
TransferFunction linear_extinction(double tau);

Volume filled(const Grid& grid, double value);

// Parallel rays along `direction`, pixels pitch_mm apart; where size_px is a power of two, the
// places of rays beside the middle are exact in fp32. The eye is 64 mm before the target.
Scene parallel(glm::dvec3 direction, glm::dvec3 target, double pitch_mm, glm::uvec2 size_px);

// Length of the line inside [low, high], beyond `from`; touching counts where a component is 0.
double chord(const Ray& ray, glm::dvec3 low, glm::dvec3 high, double from = 0.0);

// Calls check(x, y, ray) for every pixel of a scene, and tells `findings` where it is.
void for_each_pixel(const Scene& scene, Findings& findings,
                    const std::function<void(uint32_t, uint32_t, const Ray&)>& check);

// A box of one extinction, seen from beyond a plane near_mm in front of the eye: each pixel hides
// by its chord, between those of a box a rounding smaller and larger. With margin 0, lateral places
// are exact and so is the set of pixels hit.
std::function<void(const Image&, Findings&)> box_of(const Scene& scene, glm::dvec3 size_mm,
                                                    double tau, double margin_mm,
                                                    double near_mm = 0.0);

// A 2x2x2 volume that is `length` mm long in x.
SceneData bar(double length_mm);

// One ray along x through the middle of a bar, whose near face is 16 mm from the eye.
Scene through_bar(double step_mm);

// The cases, one function each; what they measure is said in the table of hard_case.cpp.
void ray_components(Painter&, Findings&);     // R1
void camera_inside(Painter&, Findings&);      // R2
void grazing(Painter&, Findings&);            // R3
void thin_structures(Painter&, Findings&);    // R4
void sharp_transfer(Painter&, Findings&);     // R5
void opacity_correction(Painter&, Findings&); // R6
void cancellation(Painter&, Findings&);       // R7
void accumulation(Painter&, Findings&);       // R8
void early_termination(Painter&, Findings&);  // R9
void partial_steps(Painter&, Findings&);      // R10
void filter_weights(Painter&, Findings&);     // R11
void storage_format(Painter&, Findings&);     // R12
void range_scaling(Painter&, Findings&);      // R13
void gradient_operator(Painter&, Findings&);  // R14
void clipped_surface(Painter&, Findings&);    // R15
void missing_data(Painter&, Findings&);       // R16
void far_or_tiny(Painter&, Findings&);        // R17
void jitter(Painter&, Findings&);             // R18
void space_skipping(Painter&, Findings&);     // R19
void brick_seams(Painter&, Findings&);        // R20
void labels(Painter&, Findings&);             // R21
void maximum_peak(Painter&, Findings&);       // R22
void iso_crossings(Painter&, Findings&);      // R23

} // namespace palpate::cases
