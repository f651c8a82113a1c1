#pragma once

#include <string>

#include "bench/cases/findings.h"
#include "bench/cases/painter.h"
#include "engine/scene/scene.h"

namespace palpate::cases {

// A scene in which something can go wrong when empty space is skipped: drawn by chance from kinds
// of volumes (matter on borders of macro-cells, gaps in the data, sizes that are no multiples of
// anything, uneven and oblique grids), transfer functions (bands, steps, visible ends, none at
// all), modes, steps, cameras (outside, inside, along the borders of cells, through their corners),
// clip planes, labels and slices. The same seed gives the same scene everywhere.
struct RandomScene {
    std::string name;
    Scene scene;
    SceneData data;
};
RandomScene random_scene(uint32_t seed);

// Draws the scenes of `count` seeds with and without skipping; no bit may differ.
void skipping_changes_nothing(Painter& painter, Findings& findings, uint32_t first, uint32_t count);

} // namespace palpate::cases
