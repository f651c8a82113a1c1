#pragma once

#include <string>
#include <vector>

#include "engine/program/interrupt.h"
#include "engine/segment/seeds.h"

namespace palpate {

// Seeds as the program reads them: of a JSON file (.json) of balls, points and curves, of strokes
// (.jsonl) that are drawn on an empty label map, or of a file that is a label map.
struct ReadSeeds {
    Volume map;
    std::vector<SeedBall> balls;     // of a JSON file
    uint16_t background = 0;         // that of a JSON file; 0: none
    std::vector<WireCurve> curves{}; // of a JSON file
};

Result<ReadSeeds> read_seeds(const std::string& path, const Volume& volume, double max_memory_mib,
                             const Interrupt& interrupt);

} // namespace palpate
