#include "engine/segment/mesh_fit.h"

#include <algorithm>
#include <cmath>

#include "engine/base/assert.h"
#include "engine/mesh/self_intersections.h"
#include "engine/segment/components.h"
#include "engine/segment/signed_distance.h"
#include "engine/volume/extent.h"

namespace palpate {

namespace {

constexpr double kCore = 0.5; // of the greatest depth

template <class Visit>
void for_each_core_sample(const Volume& distance, const Visit& visit) {
    const float least = float(kCore * double{distance.range().min});
    for_each_brick(distance, [&](glm::uvec3 position) {
        const Brick& brick = distance.brick(position);
        if (!(brick.range().min <= least))
            return;
        const Brick::Pinned pinned = brick.pin();
        const glm::uvec3 valid = distance.valid_in_brick(position);
        for (uint32_t z = 0; z < valid.z; ++z)
            for (uint32_t y = 0; y < valid.y; ++y)
                for (uint32_t x = 0; x < valid.x; ++x)
                    if (brick.value(pinned, offset_in_brick({x, y, z})) <= least)
                        visit(glm::dvec3(position * kBrickSide + glm::uvec3(x, y, z)));
    });
}

// The lower triangular L with L L^T = m, which is symmetric and positive definite (Cholesky).
glm::dmat3 lower_root(const glm::dmat3& m) {
    glm::dmat3 l(0.0); // by columns, as glm has them
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k <= i; ++k) {
            double sum = m[k][i];
            for (int j = 0; j < k; ++j)
                sum -= l[j][i] * l[j][k];
            l[k][i] = i == k ? std::sqrt(sum) : sum / l[k][k];
        }
    return l;
}

} // namespace

SimplexMesh mesh_in_core(const Volume& distance, uint32_t subdivisions) {
    PALPATE_ASSERT(distance.range().min < 0.0f);
    const Grid& grid = distance.grid();
    double count = 0.0;
    glm::dvec3 sum(0.0);
    for_each_core_sample(distance, [&](glm::dvec3 index) {
        sum += world_point(grid, index);
        ++count;
    });
    const glm::dvec3 center = sum / count;
    const glm::dmat3 axes(grid.world_from_index);
    // Samples are solid: a single one has an extent.
    glm::dmat3 moments = axes * glm::transpose(axes) * (count / 12.0);
    for_each_core_sample(distance, [&](glm::dvec3 index) {
        const glm::dvec3 off = world_point(grid, index) - center;
        moments += glm::outerProduct(off, off);
    });
    // A solid ellipsoid has a fifth of its squared axes as second moments.
    const glm::dmat3 from_ball = lower_root(moments * (5.0 / count));
    SimplexMesh mesh = simplex_ellipsoid(glm::dvec3(0.0), glm::dvec3(1.0), int(subdivisions));
    for (glm::dvec3& p : mesh.positions)
        p = center + from_ball * p;
    mesh.before = mesh.positions;
    return mesh;
}

Result<MeshFit> fit_mesh(const Volume& volume, const Volume& result, const MeshFitOptions& options,
                         const Task& task) {
    PALPATE_TRY(const Volume whole, fill_holes(result, {.label = options.label}, {task.stop, {}}));
    PALPATE_TRY(const Volume distance,
                signed_distance(whole, {.of = DistanceOf::label, .label = options.label},
                                task.part(0.0, 0.2)));
    if (!(distance.range().min < 0.0f && distance.range().max > 0.0f))
        return fail("a mesh: expected some samples, and not all, of label {}", options.label);
    MeshFit fit{mesh_in_core(distance, options.subdivisions), result};
    const double still_mm = kStill * smallest_spacing_mm(result.grid());
    const auto run = [&](const SimplexForce& force, const Task& part) {
        for (uint32_t i = 0; i < options.steps; ++i) {
            if (part.stop.stop_requested())
                return false;
            if (part.progress)
                part.progress(double(i) / double(options.steps));
            ++fit.steps;
            if (simplex_step(fit.mesh, force, {}, options.simplex) <= still_mm)
                break;
        }
        return true;
    };
    const bool has_edges = options.edges_mm > 0.0;
    if (!run(toward_surface(distance), task.part(0.2, has_edges ? 0.5 : 0.8)) ||
        (has_edges && !run(toward_edges(volume, options.edges_mm), task.part(0.5, 0.8))))
        return stopped();
    fit.self_intersections = self_intersections(triangles_of(fit.mesh)).size();
    PALPATE_TRY(fit.labels,
                rasterised(fit.mesh, result.grid(), options.label, task.part(0.8, 1.0)));
    return fit;
}

} // namespace palpate
