#pragma once

#include <optional>
#include <vector>

#include "engine/segment/draw.h"
#include "engine/segment/seeds.h"
#include "engine/segment/simplex_mesh.h"
#include "engine/segment/task.h"
#include "engine/volume/volume.h"

// A person who segments, simulated: where one puts seeds, and what one corrects.
namespace palpate::bench {

// People miss: robots that click in the very middle overrate methods (Marinov et al. 2024).
struct Habits {
    double seed_radius_mm = 8.0;
    double aim_sd_mm = 3.0;      // of each coordinate
    double radius_sd = 0.1;      // share
    double mistakes_kept = 0.05; // share of the balls beside the object that are not noticed
};

// The work done by hand. Seconds are derived at these rates, and measured on nobody.
struct Interaction {
    static constexpr double kClick_s = 1.5, kPath_mm_per_s = 50.0;

    uint32_t clicks = 0;
    double path_mm = 0.0; // of the stylus from one click to the next
    double seconds() const { return clicks * kClick_s + path_mm / kPath_mm_per_s; }
};

struct Correction {
    SeedBall ball;    // label 1
    bool add = false; // to the object; else away from it
};

// Faces of a mesh that are drawn to the surface that a person wants, straight.
struct MeshPull {
    uint32_t face = 0;
    double by_mm = 0.0;        // along the direction; negative: towards the object
    double wide_mm = 0.0;      // radius of the patch about the face that goes along
    glm::dvec3 direction{0.0}; // of unit length, away from the object
};

// One person before one volume. What it does is a function of its seed, its habits and what it is
// shown. The object of a label map: samples that are not 0.
class SimulatedUser {
 public:
    SimulatedUser(uint64_t seed, const Habits& habits) : draw_(seed), habits_(habits) {}

    // The balls of simulated_seeds() in label 1, each a click.
    Result<std::vector<SeedBall>> seeds(const Volume& truth, uint32_t count, const Task& task);

    // The deepest point of the largest error (26 neighbours), drawn or erased by a ball of 0.7
    // times the depth there, 1 sample at least; absent where the result has no error.
    Result<std::optional<Correction>> correct(const Volume& truth, const Volume& result,
                                              const Task& task);

    // The face whose centre is farthest from the surface that the person wants, of which `distance`
    // is signed_distance(), drawn to its nearest place: off by the aim along the way, with a patch
    // of 0.7 times the distance, 5 mm at least. Absent where none is farther than twice the aim: it
    // is not seen.
    std::optional<MeshPull> pull(const SimplexMesh& mesh, const Volume& distance);

    const Interaction& interaction() const { return interaction_; }

 private:
    void click(glm::dvec3 at_mm);

    Draw draw_;
    Habits habits_;
    Interaction interaction_;
    std::optional<glm::dvec3> hand_mm_;
};

} // namespace palpate::bench
