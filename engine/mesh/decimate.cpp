#include "engine/mesh/decimate.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "engine/base/assert.h"
#include "engine/mesh/distance.h"
#include "engine/mesh/topology.h"
#include "engine/mesh/used_positions.h"

namespace palpate {

namespace {

constexpr uint32_t kMostAttempts = 8;
constexpr uint32_t kImprovements = 2; // attempts after the first that is near enough
constexpr double kMeasured = 0.05;    // of the error asked for: how exactly distances are measured

// The triangles of one pair of labels; the whole mesh where there are none.
struct Patch {
    uint16_t label = 0, outer = 0;
    std::vector<uint32_t> indices, fixed; // three a triangle
};

// Where there are several patches, a triangle with a corner that another patch uses too is fixed:
// were rims alone kept, two patches could each span an edge between the same two corners of their
// rim.
std::vector<Patch> patches_of(const Mesh& mesh) {
    std::map<std::pair<uint16_t, uint16_t>, Patch> patches;
    for (size_t n = 0; n < mesh.triangles.size(); ++n) {
        const uint16_t label = mesh.labels.empty() ? 0 : mesh.labels[n];
        const uint16_t outer = mesh.outer_labels.empty() ? 0 : mesh.outer_labels[n];
        Patch& patch = patches[{label, outer}];
        patch.label = label;
        patch.outer = outer;
        for (int i = 0; i < 3; ++i)
            patch.indices.push_back(mesh.triangles[n][i]);
    }
    std::vector<Patch> list;
    for (auto& [key, patch] : patches)
        list.push_back(std::move(patch));
    if (list.size() == 1)
        return list;
    constexpr uint32_t kNone = ~0u, kSeveral = ~0u - 1;
    std::vector<uint32_t> patch_of(mesh.positions.size(), kNone);
    for (uint32_t p = 0; p < list.size(); ++p)
        for (const uint32_t v : list[p].indices)
            patch_of[v] = patch_of[v] == kNone || patch_of[v] == p ? p : kSeveral;
    for (Patch& patch : list) {
        const std::vector<uint32_t> all = std::move(patch.indices);
        patch.indices.clear();
        for (size_t i = 0; i < all.size(); i += 3) {
            const bool is_fixed = patch_of[all[i]] == kSeveral ||
                                  patch_of[all[i + 1]] == kSeveral ||
                                  patch_of[all[i + 2]] == kSeveral;
            std::vector<uint32_t>& to = is_fixed ? patch.fixed : patch.indices;
            to.insert(to.end(), all.begin() + static_cast<std::ptrdiff_t>(i),
                      all.begin() + static_cast<std::ptrdiff_t>(i + 3));
        }
    }
    return list;
}

// Positions in world axes about the mesh's own origin, as meshoptimizer takes them: an error there
// is an error in millimetres.
std::vector<glm::vec3> points_mm(const Mesh& mesh) {
    const glm::dmat3 linear(mesh.world_from_mesh);
    std::vector<glm::vec3> points;
    points.reserve(mesh.positions.size());
    for (const glm::vec3 p : mesh.positions)
        points.emplace_back(linear * glm::dvec3(p));
    return points;
}

Mesh collapsed(const Mesh& mesh, const std::vector<Patch>& patches,
               const std::vector<glm::vec3>& points, double error_mm, double least_share) {
    const float scale = meshopt_simplifyScale(&points[0].x, points.size(), sizeof(glm::vec3));
    const auto error = static_cast<float>(error_mm / double(scale));
    Mesh result{.world_from_mesh = mesh.world_from_mesh};
    for (const Patch& patch : patches) {
        std::vector<uint32_t> indices(patch.indices.size());
        const size_t triangles = patch.indices.size() / 3;
        const auto least = 3 * static_cast<size_t>(std::ceil(least_share * double(triangles)));
        indices.resize(meshopt_simplify(indices.data(), patch.indices.data(), patch.indices.size(),
                                        &points[0].x, points.size(), sizeof(glm::vec3), least,
                                        error, patches.size() > 1 ? meshopt_SimplifyLockBorder : 0,
                                        nullptr));
        indices.insert(indices.end(), patch.fixed.begin(), patch.fixed.end());
        for (size_t i = 0; i < indices.size(); i += 3)
            result.triangles.emplace_back(indices[i], indices[i + 1], indices[i + 2]);
        if (!mesh.labels.empty())
            result.labels.resize(result.triangles.size(), patch.label);
        if (!mesh.outer_labels.empty())
            result.outer_labels.resize(result.triangles.size(), patch.outer);
    }
    std::vector<uint32_t> renamed;
    take_used_positions(mesh, result, renamed);
    return result;
}

bool is_as_sound(const MeshTopology& after, const MeshTopology& before) {
    return after.open_edges <= before.open_edges &&
           after.non_manifold_edges <= before.non_manifold_edges &&
           after.non_manifold_vertices <= before.non_manifold_vertices &&
           after.duplicate_triangles <= before.duplicate_triangles &&
           after.misoriented_edges <= before.misoriented_edges &&
           after.euler_number == before.euler_number;
}

} // namespace

Result<Decimated> decimate(const Mesh& mesh, const DecimateOptions& options) {
    PALPATE_ASSERT_CMP(options.error_mm, >, 0.0);
    if (mesh.triangles.empty())
        return Decimated{mesh, 0.0, 0};
    const std::vector<Patch> patches = patches_of(mesh);
    const std::vector<glm::vec3> points = points_mm(mesh);
    const MeshTopology before = topology(mesh);
    const TriangleTree original(mesh);
    const DistanceOptions exactly{.tolerance_mm = kMeasured * options.error_mm, .samples = 20'000};
    Decimated best{mesh, 0.0, 0};
    // What the collapse is told lies between an error known to be good and one known to be too far.
    double error_mm = options.error_mm, good_mm = 0.0, far_mm = 0.0;
    uint32_t improvements = 0;
    for (uint32_t attempt = 1; attempt <= kMostAttempts; ++attempt) {
        if (options.stop.stop_requested())
            return fail("decimation was stopped");
        Mesh result = collapsed(mesh, patches, points, error_mm, options.least_share);
        double hausdorff_mm = 2.0 * options.error_mm;
        if (is_as_sound(topology(result), before)) {
            const TriangleTree tree(result);
            hausdorff_mm = std::max(distance_to_mesh(original, tree, exactly).largest_mm,
                                    distance_to_mesh(tree, original, exactly).largest_mm) +
                           exactly.tolerance_mm;
        }
        best.attempts = attempt;
        if (hausdorff_mm <= options.error_mm) {
            best.mesh = std::move(result);
            best.hausdorff_mm = hausdorff_mm;
            good_mm = error_mm;
            if (far_mm == 0.0 || ++improvements > kImprovements)
                break;
        } else {
            far_mm = error_mm;
            if (good_mm > 0.0 && ++improvements > kImprovements)
                break;
        }
        error_mm = good_mm > 0.0
                       ? std::sqrt(good_mm * far_mm)
                       : error_mm * std::clamp(0.9 * options.error_mm / hausdorff_mm, 0.2, 0.9);
    }
    return best;
}

} // namespace palpate
