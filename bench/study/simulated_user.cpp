#include "bench/study/simulated_user.h"

#include <algorithm>
#include <cmath>

#include "bench/study/samples.h"
#include "engine/base/assert.h"
#include "engine/segment/signed_distance.h"
#include "engine/segment/simulated_seeds.h"
#include "engine/volume/builder.h"
#include "engine/volume/sample.h"

namespace palpate::bench {

namespace {

// Samples of the largest set of equal, non-zero `kinds` that hang together by 26 neighbours; of
// equal ones the first.
std::vector<size_t> largest_part(glm::uvec3 size, std::vector<uint8_t> kinds) {
    std::vector<size_t> largest;
    for (size_t start = 0; start < kinds.size(); ++start) {
        if (kinds[start] == 0)
            continue;
        const uint8_t kind = kinds[start];
        std::vector<size_t> part{start};
        kinds[start] = 0;
        for (size_t i = 0; i < part.size(); ++i) {
            const glm::ivec3 at(index_of(size, part[i]));
            const glm::ivec3 low = glm::max(at - 1, glm::ivec3(0));
            const glm::ivec3 high = glm::min(at + 1, glm::ivec3(size) - 1);
            for (int z = low.z; z <= high.z; ++z)
                for (int y = low.y; y <= high.y; ++y)
                    for (int x = low.x; x <= high.x; ++x) {
                        const size_t other =
                            size_t(x) + size.x * (size_t(y) + size_t{size.y} * size_t(z));
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
    PALPATE_TRY(SeedFile made, simulated_seeds(truth,
                                               {.label = 1,
                                                .count = count,
                                                .radius_mm = habits_.seed_radius_mm,
                                                .jitter_mm = habits_.aim_sd_mm,
                                                .radius_sd = habits_.radius_sd,
                                                .mistakes = habits_.mistakes_kept,
                                                .random = draw_.bits()},
                                               task));
    for (const SeedBall& ball : made.balls)
        click(ball.center_mm);
    return std::move(made.balls);
}

Result<std::optional<Correction>> SimulatedUser::correct(const Volume& truth, const Volume& result,
                                                         const Task& task) {
    PALPATE_ASSERT(truth.grid() == result.grid());
    const Grid& grid = truth.grid();
    const glm::uvec3 size = grid.size;
    const std::vector<float> wanted = samples_of(truth), found = samples_of(result);
    std::vector<uint8_t> kinds(wanted.size()); // 1: missed, 2: surplus
    for (size_t i = 0; i < kinds.size(); ++i)
        if ((wanted[i] != 0.0f) != (found[i] != 0.0f))
            kinds[i] = wanted[i] != 0.0f ? 1 : 2;
    const std::vector<size_t> part = largest_part(size, kinds);
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
        if (const double depth = -distance.value(index_of(size, i)); depth > depth_mm) {
            depth_mm = depth;
            deepest = i;
        }
    const glm::dvec3 missed_by{draw_.normal(), draw_.normal(), draw_.normal()};
    // One misses small errors by less: nobody aims at a voxel with a ball's freedom.
    const double aim_mm = std::min(habits_.aim_sd_mm, 0.3 * depth_mm);
    const SeedBall ball{1,
                        world_point(grid, glm::dvec3(index_of(size, deepest))) + aim_mm * missed_by,
                        std::max(0.7 * depth_mm, glm::length(spacing_mm(grid)) / std::sqrt(3.0))};
    click(ball.center_mm);
    return std::optional(Correction{ball, kinds[deepest] == 1});
}

std::optional<MeshPull> SimulatedUser::pull(const SimplexMesh& mesh, const Volume& distance) {
    SampleCursor wanted(distance);
    MeshPull worst;
    glm::dvec3 at_mm(0.0);
    for (uint32_t f = 0; f < mesh.faces(); ++f) {
        const auto corners =
            std::span(mesh.face_vertices)
                .subspan(mesh.face_first[f], mesh.face_first[f + 1] - mesh.face_first[f]);
        glm::dvec3 center(0.0);
        for (const uint32_t v : corners)
            center += mesh.positions[v] / double(corners.size());
        const double off_mm = wanted.value(index_point(distance.grid(), center));
        if (!(std::abs(off_mm) > std::abs(worst.by_mm)))
            continue; // nor where it has no data
        worst.face = f;
        worst.by_mm = -off_mm;
        at_mm = center;
    }
    if (std::abs(worst.by_mm) <= 2.0 * habits_.aim_sd_mm)
        return std::nullopt;
    const glm::dvec3 away =
        world_gradient(distance.grid(), wanted.gradient(index_point(distance.grid(), at_mm)));
    if (!(glm::length(away) > 1e-3)) // as far from two places of the surface
        return std::nullopt;
    worst.direction = glm::normalize(away);
    worst.wide_mm = std::max(5.0, 0.7 * std::abs(worst.by_mm));
    worst.by_mm += habits_.aim_sd_mm * draw_.normal();
    click(at_mm);
    interaction_.path_mm += std::abs(worst.by_mm);
    hand_mm_ = at_mm + worst.by_mm * worst.direction;
    return worst;
}

} // namespace palpate::bench
