#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bench/touch/solid.h"
#include "engine/base/error.h"
#include "haptics/field/algorithm.h"

namespace palpate::touch {

// Reach of a scene's volume, to every side of the origin.
constexpr double kReach_mm = 16.0;
// Reach of flat walls. Hands stay within 11 mm of the middle on each axis, so within 19.1 mm of it,
// and so do their projections to a plane through the middle; a proxy on its way there steps 4 of
// the smallest spacings beyond at most. In a smaller volume such a way leads round the wall's rim.
constexpr double kWallReach_mm = 26.0;

// How a scene's body is stored.
enum class Form { grey_f32, grey_i16, labels };

struct Storage {
    glm::dvec3 spacing_mm{0.5};
    Form form = Form::grey_f32;
    double noise = 0.0; // standard deviation as a share of the contrast
    uint64_t seed = 1;
};
constexpr glm::dvec3 kUneven_mm{0.4, 0.4, 1.2};

// The blur of a scanner: standard deviation of an edge, in spacings of the coarsest axis.
constexpr double kEdgeSamples = 0.7;
double edge_mm(const Storage& storage);
// Spacing of the coarsest axis: what errors of position are shares of.
double voxel_mm(const Storage& storage);

// A body after an edit, and for how long it stays.
struct EditStep {
    size_t ticks = 0;
    Solid solid;
    // The first snapshot itself, as an undo gives it back, and not a new one that equals it.
    bool is_undo = false;
};

// A body to touch, and from where. The touched point is near the origin of the world.
struct TouchCase {
    std::string id;   // "A1" .. "A14", of the test plan
    std::string name; // "plane/tilted"
    Solid solid;
    glm::dvec3 touch_mm{0.0};       // a point of the surface
    glm::dvec3 normal{0.0, 0.0, 1}; // there, out of the material
    glm::dvec3 along{1.0, 0.0, 0};  // there, within the surface
    // The force is frictionless and smooth here, so that excess jumps mean something.
    bool judge_jumps = true;
    double noise = 0.0;          // share of the contrast that belongs to the case (A10)
    double deepest_mm = 4;       // how far a trajectory may press before the truth ends
    double free_mm = 5;          // how far above the touched point a small tool is free
    double reach_mm = kReach_mm; // of its volume, to every side of the origin
    bool is_thin = false; // a wall below 1.5 voxels, of which nobody is asked to hold a point out

    // For cases A11 - A14; see special_cases.h.
    std::vector<EditStep> edits; // one after the other, over and over; the first is `solid`
    // The force itself, where no surface gives it, for a tool here and a proxy that was there in
    // the tick before; none where the closed form has no answer.
    std::function<std::optional<glm::dvec3>(glm::dvec3 tool_mm, glm::dvec3 last_proxy_mm)> force_n;
    std::optional<haptics::HapticTransfer> transfer; // along the normal, instead of 3 N
    std::vector<std::string> felt_by;                // names of algorithms; empty: by all
    std::string why_not; // by no algorithm in this storage, or by none but `felt_by`, because
    // Fills the scene, where the density does not.
    std::function<void(const TouchCase& body, const Storage& storage, haptics::TouchScene& touch,
                       double& iso)>
        store;
};

// A case as a volume: what an algorithm is given. Grey values run from 0 in free space to 1000 in
// material with the surface at 500; labels are 0 and 1.
struct Scene {
    TouchCase body;
    Storage storage;
    haptics::TouchScene touch;
    double iso = 500.0;

    struct Stage {
        size_t ticks;
        Solid solid;
        haptics::TouchScene touch;
    };
    std::vector<Stage> stages; // of body.edits
    // The index of the one at a tick; `touch` for ever where there are none.
    size_t stage_at(size_t tick) const;
};

Scene make_scene(const TouchCase& body, const Storage& storage);

// The grid of a scene, off the lattice, so that no surface lies on samples by chance.
Grid scene_grid(const Storage& storage, double reach_mm = kReach_mm);

// The analytic cases of the plan's A1 - A10 for a storage (walls are counted in voxels). `all`:
// every angle and thickness; else one or two of each kind.
std::vector<TouchCase> touch_cases(const Storage& storage, bool all);

// Depth of a point under the surface in mm; negative in free space.
inline double depth_mm(const TouchCase& body, glm::dvec3 mm) {
    return -body.solid.distance_mm(mm);
}

} // namespace palpate::touch
