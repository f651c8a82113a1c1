#include "engine/segment/simulated_seeds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/segment/draw.h"
#include "engine/segment/signed_distance.h"

namespace palpate {

namespace {

constexpr int kDrawn = 64;

std::vector<glm::uvec3> deep_samples(const Volume& distance, double depth_mm) {
    std::vector<glm::uvec3> found;
    for_each_brick(distance, [&](glm::uvec3 position) {
        const Brick& brick = distance.brick(position);
        if (!(brick.range().min <= -depth_mm))
            return;
        const Brick::Pinned pinned = brick.pin();
        const glm::uvec3 valid = distance.valid_in_brick(position);
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x)
                    if (brick.value(pinned, offset_in_brick({x, y, z})) <= -depth_mm)
                        found.push_back(position * kBrickSide + glm::uvec3(x, y, z));
    });
    return found;
}

// The drawn place that is farthest from all centres so far.
glm::dvec3 next_place(const Grid& grid, const std::vector<glm::uvec3>& deep,
                      const std::vector<glm::dvec3>& before, Draw& draw) {
    glm::dvec3 best{};
    double farthest = -1.0;
    for (int i = 0; i < (before.empty() ? 1 : kDrawn); ++i) {
        const glm::dvec3 place = world_point(grid, glm::dvec3(deep[draw.below(deep.size())]));
        double nearest = std::numeric_limits<double>::max();
        for (const glm::dvec3& other : before)
            nearest = std::min(nearest, glm::length(place - other));
        if (nearest > farthest) {
            farthest = nearest;
            best = place;
        }
    }
    return best;
}

// Whether a place lies in the volume, and in the object.
struct Where {
    bool in_volume, in_object;
};
Where where(const Volume& labels, uint16_t label, glm::dvec3 mm) {
    const glm::dvec3 index = glm::round(index_point(labels.grid(), mm));
    if (glm::any(glm::lessThan(index, glm::dvec3(0.0))) ||
        glm::any(glm::greaterThanEqual(index, glm::dvec3(labels.size()))))
        return {false, false};
    return {true, labels.value(glm::uvec3(index)) == float(label)};
}

} // namespace

Result<SeedFile> simulated_seeds(const Volume& labels, const SimulatedSeedOptions& options,
                                 const Task& task) {
    PALPATE_TRY(const Volume distance,
                signed_distance(labels, {.of = DistanceOf::label, .label = options.label}, task));
    // A map that is full of the label has no distances.
    const double deepest = distance.range().empty() ? 0.0 : -double(distance.range().min);
    if (!(deepest > 0.0))
        return fail("expected a label map in which some samples, and not all, have label {}",
                    options.label);
    const std::vector<glm::uvec3> deep =
        deep_samples(distance, std::min(1.2 * options.radius_mm, 0.5 * deepest));
    Draw draw(options.random);
    SeedFile file{{}, 0, labels.grid()};
    std::vector<glm::dvec3> places;
    for (uint32_t n = 0; n < options.count; ++n) {
        const glm::dvec3 place = next_place(labels.grid(), deep, places, draw);
        places.push_back(place);
        glm::dvec3 center = place;
        for (int tries = 0; tries < 100; ++tries) {
            const glm::dvec3 moved =
                place + options.jitter_mm * glm::dvec3{draw.normal(), draw.normal(), draw.normal()};
            const Where lies = where(labels, options.label, moved);
            if (lies.in_object || (lies.in_volume && draw.between(0.0, 1.0) < options.mistakes)) {
                center = moved;
                break;
            }
        }
        const double change = std::clamp(1.0 + options.radius_sd * draw.normal(), 0.5, 1.5);
        file.balls.push_back({options.label, center, options.radius_mm * change});
    }
    return file;
}

} // namespace palpate
