#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "engine/segment/task.h"

namespace palpate {

// A volume that is computed a brick at a time: the result of a filter that reads nothing but the
// samples near its place. It can be made whole, or written to a brick file without being in memory.
struct BrickMaker {
    Grid grid;
    ScalarType type{};
    // The brick at a position (in bricks); from any thread. A function of the position alone.
    std::function<BrickPtr(glm::uvec3 position)> brick;
};

// All bricks of it.
Result<Volume> make_bricks(const BrickMaker& maker, const Task& task);

// Samples of a brick and `halo` more to each side, as float; those beyond the volume repeat the
// nearest one within. No data is NaN.
struct Neighbourhood {
    glm::ivec3 size{}; // 32 + 2 halo; on z as many as the volume has of the brick's, + 2 halo
    std::vector<float> samples;
    bool lacks_data = false; // some may be NaN; false: none is

    // The value of all samples, where the bricks they lie in have but one; samples is empty then.
    std::optional<float> constant;
};
void read_neighbourhood(const Volume& volume, glm::uvec3 brick, glm::ivec3 halo,
                        Neighbourhood& out);

// Whether the bricks that hold those samples are constant and of one value, which is returned.
std::optional<float> constant_around(const Volume& volume, glm::uvec3 brick, glm::ivec3 halo);

// Filters that weight and add in single precision take values of at most this, so that no sum or
// derivative exceeds the largest float, 3.4e38. Beyond it, a sentence that says so.
constexpr float kLargestFiltered = 1e30f;
Result<void> check_magnitude(const Volume& volume);

// A constant brick of a type that holds the value.
BrickPtr constant_brick(ScalarType type, float value);

} // namespace palpate
