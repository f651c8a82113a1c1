#include "bench/study/simulated_user.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/assert.h"
#include "engine/segment/signed_distance.h"
#include "engine/volume/builder.h"

namespace palpate::bench {

namespace {

constexpr int kCandidates = 64;
constexpr double kDeep = 1.2; // radii

// The samples of a volume in one array, x fastest: trials are small.
struct Flat {
    explicit Flat(const Volume& volume)
        : size(volume.size()), values(size_t{size.x} * size.y * size.z) {
        for (uint32_t z = 0; z < size.z; ++z)
            for (uint32_t y = 0; y < size.y; ++y)
                read_row(volume, {0, y, z}, size.x, &values[size.x * (y + size_t{size.y} * z)]);
    }
    glm::uvec3 index(size_t i) const {
        return {i % size.x, i / size.x % size.y, i / (size_t{size.x} * size.y)};
    }
    size_t place(glm::uvec3 at) const { return at.x + size.x * (at.y + size_t{size.y} * at.z); }

    glm::uvec3 size;
    std::vector<float> values;
};

// Samples of the largest set of equal, non-zero `kinds` that hang together by 26 neighbours; of
// equal ones the first.
std::vector<size_t> largest_part(const Flat& shape, std::vector<uint8_t> kinds) {
    std::vector<size_t> largest;
    for (size_t start = 0; start < kinds.size(); ++start) {
        if (kinds[start] == 0)
            continue;
        const uint8_t kind = kinds[start];
        std::vector<size_t> part{start};
        kinds[start] = 0;
        for (size_t i = 0; i < part.size(); ++i) {
            const glm::ivec3 at(shape.index(part[i]));
            const glm::ivec3 low = glm::max(at - 1, glm::ivec3(0));
            const glm::ivec3 high = glm::min(at + 1, glm::ivec3(shape.size) - 1);
            for (int z = low.z; z <= high.z; ++z)
                for (int y = low.y; y <= high.y; ++y)
                    for (int x = low.x; x <= high.x; ++x) {
                        const size_t other = shape.place(glm::uvec3(x, y, z));
                        if (kinds[other] == kind) {
                            kinds[other] = 0;
                            part.push_back(other);
                        }
                    }
        }
        if (part.size() > largest.size())
            largest = std::move(part);
    }
    return largest;
}

} // namespace

void SimulatedUser::click(glm::dvec3 at_mm) {
    ++interaction_.clicks;
    if (hand_mm_)
        interaction_.path_mm += glm::distance(*hand_mm_, at_mm);
    hand_mm_ = at_mm;
}

Result<std::vector<SeedBall>> SimulatedUser::seeds(const Volume& truth, uint32_t count,
                                                   const Task& task) {
    const Grid& grid = truth.grid();
    PALPATE_TRY(const Volume distance, signed_distance(truth, {}, task));
    const Flat depths(distance), object(truth);
    std::vector<size_t> deep;
    size_t deepest = 0;
    const double enough_mm = kDeep * habits_.seed_radius_mm;
    for (size_t i = 0; i < depths.values.size(); ++i) {
        if (object.values[i] != 0.0f && -depths.values[i] >= enough_mm)
            deep.push_back(i);
        if (depths.values[i] < depths.values[deepest])
            deepest = i;
    }
    if (object.values[deepest] == 0.0f)
        return fail("expected an object, found none");
    if (deep.empty())
        deep = {deepest};
    const auto point = [&](size_t i) { return world_point(grid, glm::dvec3(depths.index(i))); };

    std::vector<SeedBall> balls;
    while (balls.size() < count) {
        size_t best = deep[draw_.below(deep.size())];
        double far_mm = -1.0;
        for (int candidate = 0; !balls.empty() && candidate < kCandidates; ++candidate) {
            const size_t other = deep[draw_.below(deep.size())];
            double near_mm = std::numeric_limits<double>::infinity();
            for (const SeedBall& ball : balls)
                near_mm = std::min(near_mm, glm::distance(ball.center_mm, point(other)));
            if (near_mm > far_mm) {
                far_mm = near_mm;
                best = other;
            }
        }
        const glm::dvec3 aim_mm = point(best);
        const glm::dvec3 missed_by(draw_.normal(), draw_.normal(), draw_.normal());
        const SeedBall ball{
            1, aim_mm + habits_.aim_sd_mm * missed_by,
            habits_.seed_radius_mm * std::max(1.0 + habits_.radius_sd * draw_.normal(), 0.5)};
        const glm::dvec3 nearest = glm::round(index_point(grid, ball.center_mm));
        const bool within = glm::all(glm::greaterThanEqual(nearest, glm::dvec3(0.0))) &&
                            glm::all(glm::lessThan(nearest, glm::dvec3(grid.size))) &&
                            object.values[object.place(glm::uvec3(nearest))] != 0.0f;
        const bool unnoticed = draw_.between(0.0, 1.0) < habits_.mistakes_kept;
        click(ball.center_mm);
        if (within || unnoticed)
            balls.push_back(ball);
    }
    return balls;
}

Result<std::optional<Correction>> SimulatedUser::correct(const Volume& truth, const Volume& result,
                                                         const Task& task) {
    PALPATE_ASSERT(truth.grid() == result.grid());
    const Grid& grid = truth.grid();
    const Flat wanted(truth), found(result);
    std::vector<uint8_t> kinds(wanted.values.size()); // 1: missed, 2: surplus
    for (size_t i = 0; i < kinds.size(); ++i)
        if ((wanted.values[i] != 0.0f) != (found.values[i] != 0.0f))
            kinds[i] = wanted.values[i] != 0.0f ? 1 : 2;
    const std::vector<size_t> part = largest_part(wanted, kinds);
    if (part.empty())
        return std::optional<Correction>();
    std::vector<uint8_t> mask(kinds.size());
    for (const size_t i : part)
        mask[i] = 1;
    PALPATE_TRY(const Volume distance,
                signed_distance(make_volume(grid, std::span<const uint8_t>(mask)), {}, task));
    size_t deepest = part.front();
    double depth_mm = 0.0;
    for (const size_t i : part)
        if (const double depth = -distance.value(wanted.index(i)); depth > depth_mm) {
            depth_mm = depth;
            deepest = i;
        }
    const glm::dvec3 missed_by(draw_.normal(), draw_.normal(), draw_.normal());
    // One misses small errors by less: nobody aims at a voxel with a ball's freedom.
    const double aim_mm = std::min(habits_.aim_sd_mm, 0.3 * depth_mm);
    const SeedBall ball{1,
                        world_point(grid, glm::dvec3(wanted.index(deepest))) + aim_mm * missed_by,
                        std::max(0.7 * depth_mm, glm::length(spacing_mm(grid)) / std::sqrt(3.0))};
    click(ball.center_mm);
    return std::optional(Correction{ball, kinds[deepest] == 1});
}

} // namespace palpate::bench
