#pragma once

#include <cstdint>
#include <functional>
#include <limits>

#include "engine/segment/gaussian.h"
#include "engine/segment/task.h"

// Level sets: a surface that moves through a volume, and closes, splits and joins as it goes.
//
// The surface is where phi = 0, phi < 0 inside. It moves along its outward normal n with the speed
//     F = a P - b Z k + (v + w) . n
//     phi_t = -a P |grad phi| + b Z k |grad phi| - (v + w) . grad phi
// (Osher & Sethian 1988). P, the propagation speed, and Z are of no unit, and so time is in mm: a
// surface with a P = 1 goes 1 mm in 1. k = div(grad phi / |grad phi|) in 1 / mm is the sum of both
// principal curvatures, 2 / r of a sphere; so a sphere under a = 0, b = 1 mm shrinks as
// r^2 = r0^2 - 4 t, and with a P = 1 bumps of a radius below 2 b mm go away. v = -c grad Z draws
// the surface to where Z is least (the geodesic active contour: Caselles, Kimmel & Sapiro 1997),
// and w is a given field, such as gradient vector flow. level_set_speed.h makes P and Z.
//
// All lengths are of the grid's metric: unequal spacing, turned and sheared axes.
namespace palpate {

struct LevelSetStart {
    const Volume* labels = nullptr;   // inside are the samples of `label`,
    uint16_t label = 0;               // 0: of any,
    const Volume* distance = nullptr; // or where this signed distance in mm is below 0
};

// All have one size. Samples where one of them has no data are never entered. Packed floats are u16
// (packed_floats.h): vector_flow() makes such.
struct LevelSetForces {
    const Volume* speed = nullptr;     // P, f32; null: 1
    const Volume* edge = nullptr;      // Z, f32; null: 1
    const VectorField* flow = nullptr; // w, mm per mm of time; f32, or packed floats; null: 0
};

struct LevelSetReport {
    enum class End { iterations, settled, vanished, time };
    End end = End::iterations;
    int iterations = 0;
    double time = 0.0;      // that the surface has moved for
    double change_mm = 0.0; // of the last iteration, root mean square of the samples at the surface
};

struct LevelSetOptions {
    double propagation = 1.0;  // a
    double curvature_mm = 0.0; // b, >= 0
    double advection_mm = 0.0; // c, >= 0; needs an edge
    double flow = 1.0;         // factor of w
    // Ends after so many iterations, or at this time, or once an iteration changes the distances of
    // the samples at the surface by no more than this (root mean square).
    int most_iterations = 500;
    double last_time = std::numeric_limits<double>::infinity();
    double tolerance_mm = 0.0;
    // Called in this thread after every `every` iterations, so that the surface can be seen to
    // move.
    int every = 0;
    std::function<void(const Volume& labels, const LevelSetReport& report)> moved;
    bool with_distance = false;
};

struct LevelSetResult {
    Volume labels; // u8, 1 inside
    // f32, mm, negative inside: within two of the smallest spacings of the surface; beyond it is
    // +- that. No data where the surface may not go.
    std::optional<Volume> distance;
    LevelSetReport report;
};

// Moves the surface. Sparse field (Whitaker 1998; level_set_band.h): only the samples beside the
// surface are moved, with upwind differences of third order (WENO, Godunov's choice) for P, v
// and w and central ones for k, and the distances around are made anew from them.
//
// Time goes in the largest steps that keep the scheme stable: Euler's, and with a flow Heun's of
// second order, as Euler's carry a surface outward where a flow turns. The number of threads
// changes no bit. Memory beside the forces: 0.25 bytes a sample, and 8.5 in bricks near the
// surface; 0.75 while it begins.
//
// Refused, in one sentence: volumes of another size or type, no sample to start from, numbers out
// of range, advection without an edge.
Result<LevelSetResult> level_set(const LevelSetStart& start, const LevelSetForces& forces,
                                 const LevelSetOptions& options, const Task& task);

// "settled after 40 iterations: ..." for people.
std::string text_of(const LevelSetReport& report);

} // namespace palpate
