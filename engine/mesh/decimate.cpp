#include "engine/mesh/decimate.h"

#include <algorithm>

#include "engine/mesh/distance.h"
#include "engine/mesh/mesh_check.h"
#include "engine/mesh/used_positions.h"

namespace palpate {

namespace {

constexpr double kMeasured = 0.01; // how exactly distances are measured, of the error
// Collapses are given this share of the error asked for, as what they prove for all points is
// EdgeCollapse::kProof times as far, and is measured to kMeasured.
constexpr double kGiven = (1.0 - 1.5 * kMeasured) / EdgeCollapse::kProof;
// Rounding alone could take the measurement beyond the error; then less is given.
constexpr int kMostAttempts = 3;

// The rest of the original, and the original triangle that each triangle was.
struct Remainder {
    Mesh mesh;
    std::vector<uint32_t> triangles;
};

// The original's normal at the point of it nearest to where a vertex went.
glm::vec3 normal_near(const CollapseSource& source, uint32_t patch, glm::dvec3 point) {
    const TriangleTree::Nearest nearest = source.trees[patch].nearest(point);
    const uint32_t n = source.triangles_of_patch[patch][nearest.triangle];
    const glm::uvec3 t = source.mesh.triangles[n];
    const glm::dvec3 a = source.points[t.x], u = source.points[t.y] - a, v = source.points[t.z] - a,
                     w = nearest.point_mm - a;
    const glm::dvec3 normal = glm::cross(u, v);
    const double square = glm::dot(normal, normal);
    const double y = square > 0.0 ? glm::dot(glm::cross(w, v), normal) / square : 0.0;
    const double z = square > 0.0 ? glm::dot(glm::cross(u, w), normal) / square : 0.0;
    const std::vector<glm::vec3>& normals = source.mesh.normals;
    const glm::dvec3 sum = (1.0 - y - z) * glm::dvec3(normals[t.x]) + y * glm::dvec3(normals[t.y]) +
                           z * glm::dvec3(normals[t.z]);
    const double length = glm::length(sum);
    return length > 0.0 ? glm::vec3(sum / length) : normals[t.x];
}

Remainder remainder(const CollapseSource& source, const EdgeCollapse& collapse) {
    const Mesh& mesh = source.mesh;
    Remainder left{.mesh = {.world_from_mesh = mesh.world_from_mesh},
                   .triangles = collapse.survivors()};
    Mesh moved{.positions = mesh.positions, .normals = mesh.normals};
    for (const uint32_t n : left.triangles) {
        const glm::uvec3 t = collapse.triangle(n);
        left.mesh.triangles.push_back(t);
        if (!mesh.labels.empty())
            left.mesh.labels.push_back(mesh.labels[n]);
        if (!mesh.outer_labels.empty())
            left.mesh.outer_labels.push_back(mesh.outer_labels[n]);
        for (int i = 0; i < 3; ++i) {
            const uint32_t v = t[i];
            if (!collapse.has_moved(v) || moved.positions[v] == collapse.position(v))
                continue;
            moved.positions[v] = collapse.position(v);
            if (!mesh.normals.empty())
                moved.normals[v] =
                    normal_near(source, source.patch[n],
                                glm::dvec3(source.local_from_mesh *
                                           glm::dvec4(glm::dvec3(moved.positions[v]), 1.0)));
        }
    }
    std::vector<uint32_t> renamed;
    take_used_positions(moved, left.mesh, renamed);
    return left;
}

// The triangles of each patch of what is left, numbered as in Remainder.
std::vector<std::vector<uint32_t>> patches_of(const CollapseSource& source, const Remainder& left) {
    std::vector<std::vector<uint32_t>> patches(source.trees.size());
    for (uint32_t i = 0; i < left.triangles.size(); ++i)
        patches[source.patch[left.triangles[i]]].push_back(i);
    return patches;
}

TriangleTree tree_of(const CollapseSource& source, const Remainder& left,
                     const std::vector<uint32_t>& chosen) {
    Mesh part{.world_from_mesh = source.local_from_mesh};
    for (const uint32_t i : chosen)
        part.triangles.push_back(left.mesh.triangles[i]);
    std::vector<uint32_t> renamed;
    take_used_positions(left.mesh, part, renamed);
    return TriangleTree(part);
}

// The Hausdorff distance, or up to tolerance_mm more; of all patches.
double distance_mm(const CollapseSource& source, const Remainder& left, double tolerance_mm,
                   const std::stop_token& stop) {
    const DistanceOptions exactly{.tolerance_mm = tolerance_mm, .samples = 1, .stop = stop};
    double largest_mm = 0.0;
    const std::vector<std::vector<uint32_t>> patches = patches_of(source, left);
    for (size_t p = 0; p < patches.size(); ++p) {
        const TriangleTree tree = tree_of(source, left, patches[p]);
        for (const double mm : {distance_to_mesh(source.trees[p], tree, exactly).largest_mm,
                                distance_to_mesh(tree, source.trees[p], exactly).largest_mm})
            largest_mm = std::max(largest_mm, mm + tolerance_mm);
    }
    return largest_mm;
}

} // namespace

Result<Decimated> decimate(const Mesh& mesh, const DecimateOptions& options) {
    if (!(options.error_mm > 0.0))
        return fail("decimation: expected an error above 0 mm, found {}", options.error_mm);
    PALPATE_TRY(check_mesh(mesh));
    if (mesh.triangles.empty())
        return Decimated{mesh};
    const CollapseSource source(mesh);
    double limit_mm = kGiven * options.error_mm;
    for (int attempt = 0; attempt < kMostAttempts; ++attempt, limit_mm *= 0.5) {
        EdgeCollapse collapse(source, {.limit_mm = limit_mm,
                                       .least_triangles = options.least_triangles,
                                       .stop = options.stop,
                                       .progress = options.progress});
        collapse.run();
        if (options.stop.stop_requested())
            return fail("decimation was stopped");
        Remainder left = remainder(source, collapse);
        const double hausdorff_mm =
            distance_mm(source, left, kMeasured * std::min(options.error_mm, collapse.level_mm()),
                        options.stop);
        if (options.stop.stop_requested())
            return fail("decimation was stopped");
        if (hausdorff_mm <= options.error_mm)
            return Decimated{std::move(left.mesh), hausdorff_mm, collapse.kept()};
    }
    return Decimated{mesh};
}

} // namespace palpate
