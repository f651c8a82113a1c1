#include "engine/segment/edges.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/volume/box.h"

namespace palpate {

namespace {

constexpr int kPadded = int(kBrickSide) + 2;

// The difference across a sample; one-sided where a neighbour has no data, 0 where neither has.
double difference(double low, double here, double high) {
    if (std::isnan(low))
        return std::isnan(high) ? 0.0 : high - here;
    return std::isnan(high) ? here - low : 0.5 * (high - low);
}

// The largest float where there is more.
float edge_of(double length) {
    return float(std::min(length, double{std::numeric_limits<float>::max()}));
}

BrickPtr edges_of_brick(const Volume& volume, const glm::dmat3& world_from_gradient,
                        glm::uvec3 position) {
    thread_local std::vector<float> in(size_t{kPadded} * kPadded * kPadded), out(kBrickSamples);
    const glm::ivec3 first = glm::ivec3(position * kBrickSide) - 1;
    read_box(volume, first, glm::ivec3(kPadded), packed(glm::uvec3(kPadded)), in.data());
    const glm::uvec3 valid = volume.valid_in_brick(position);
    const glm::ivec3 last = glm::ivec3(volume.size()) - 1;
    for (int z = 0; z < int(valid.z); ++z)
        for (int y = 0; y < int(valid.y); ++y)
            for (int x = 0; x < int(valid.x); ++x) {
                const float* at = &in[size_t(x + 1 + kPadded * (y + 1 + kPadded * (z + 1)))];
                const glm::ivec3 index = first + 1 + glm::ivec3(x, y, z);
                glm::dvec3 slope;
                const int strides[] = {1, kPadded, kPadded * kPadded};
                for (int k = 0; k < 3; ++k) {
                    // Beyond a face the nearest sample is repeated: no data there.
                    const double low = index[k] > 0 ? at[-strides[k]] : NAN;
                    const double high = index[k] < last[k] ? at[strides[k]] : NAN;
                    slope[k] = difference(low, double{at[0]}, high);
                }
                out[offset_in_brick(glm::uvec3(x, y, z))] =
                    std::isnan(at[0]) ? at[0] : edge_of(glm::length(world_from_gradient * slope));
            }
    return Brick::make(std::span<const float>(out), valid);
}

} // namespace

Result<Volume> edge_strength(const Volume& volume, const Task& task) {
    const glm::dmat3 world(
        glm::transpose(glm::inverse(glm::dmat3(volume.grid().world_from_index))));
    return make_bricks(volume.grid(), ScalarType::f32, task, [&](glm::uvec3 position) {
        return edges_of_brick(volume, world, position);
    });
}

} // namespace palpate
