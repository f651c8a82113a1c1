#pragma once

#include <array>
#include <string>
#include <vector>

#include "bench/touch/scenes.h"
#include "bench/touch/trajectories.h"

// A bench that cannot be fitted: bodies drawn by seed, stored through a family of edges, noises and
// grids, touched by a family of hands. Seeds below kHeldSeeds are for development, those from it on
// are run to publish figures and not looked at before.
namespace palpate::touch {

// 1001 to 1003, 2001 to 2004, 3001 to 3004, 4001 to 4024 and 5001 to 5024 have been looked at:
// raise it before figures are published anew.
constexpr uint64_t kHeldSeeds = 6000;

// How values rise across a surface: 0 in free space, 0.5 at it, 1 in material, of the distance into
// material in spacings of the coarsest axis.
enum class Edge { erf04, erf07, erf12, ramp1, ramp2, box, clipped, bone, slice };
constexpr size_t kEdges = 9;
const char* name_of(Edge edge);

// Disturbances of the values. `signal`: as the root of the value; `masked`: free space is constant;
// `salt`: 0.2 % of the samples are 0 or 1.
enum class Noise { none, white, correlated, signal, masked, ring, salt };
struct NoiseLevel {
    Noise noise;
    double share; // of the contrast, standard deviation
};
constexpr std::array<NoiseLevel, 11> kNoises{{{Noise::white, 0.05},
                                              {Noise::white, 0.1},
                                              {Noise::correlated, 0.05},
                                              {Noise::correlated, 0.1},
                                              {Noise::signal, 0.05},
                                              {Noise::signal, 0.1},
                                              {Noise::masked, 0.05},
                                              {Noise::masked, 0.1},
                                              {Noise::ring, 0.05},
                                              {Noise::ring, 0.1},
                                              {Noise::salt, 0.0}}};
std::string name_of(NoiseLevel level);

// One volume of the family: the body, grid and side conditions are the seed's.
struct FamilyScene {
    Scene scene;
    std::string name; // "cone, erf/0.7, masked 10 %, sheared, seed 3"
};
FamilyScene family_scene(uint64_t seed, Edge edge, NoiseLevel level);

// One scene of a seed. Every edge has one without noise, and every noise has one on one edge.
struct FamilyCell {
    Edge edge;
    NoiseLevel level;
};
std::vector<FamilyCell> family_cells(uint64_t seed);

// Hands: slides at 0.01 to 1 m/s, a tap of 3 m/s, a Brownian hand, a hold; at 200 Hz to 8 kHz.
struct FamilyHand {
    Trajectory trajectory;
    bool slides = false;            // the force is judged beside that of the spring
    size_t rests_from = ~size_t{0}; // the tick from which on the hand is still
};
std::vector<FamilyHand> family_hands(const TouchCase& body, uint64_t seed);

} // namespace palpate::touch
