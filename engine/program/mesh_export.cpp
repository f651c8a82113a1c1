#include "engine/program/mesh_export.h"

#include <algorithm>
#include <cmath>

#include "engine/mesh/decimate.h"
#include "engine/program/surface_labels.h"
#include "engine/surface/marching_cubes.h"
#include "engine/surface/shell.h"
#include "engine/surface/surface_nets.h"
#include "engine/volume/builder.h"
#include "engine/volume/extent.h"

namespace palpate {

namespace {

constexpr uint32_t kPasses = 10; // of smoothing, as `palpate surface --smooth bounded` has them
// A cut falls by this share of the range above the iso-value within a sample: so little that the
// matter beside it is denser nearly everywhere, and the cut is flat.
constexpr double kCutSlope = 0.05;

// How far inside of all planes a point is; negative outside of any, mm.
double depth_of(glm::dvec3 point, std::span<const ClipPlane> planes) {
    double depth = INFINITY;
    for (const ClipPlane& plane : planes)
        depth = std::min(depth, glm::dot(glm::normalize(plane.normal), point - plane.point_mm));
    return depth;
}

Result<Mesh> surface_of(const Volume& volume, const MeshExport& wanted,
                        const std::stop_token& stop) {
    if (wanted.iso) {
        const Volume cut =
            wanted.within.empty() ? volume : values_within(volume, *wanted.iso, wanted.within);
        Mesh mesh = marching_cubes(cut, static_cast<float>(*wanted.iso),
                                   {.closed_at_border = true, .stop = stop});
        if (mesh.triangles.empty() && !stop.stop_requested())
            return fail("expected values on both sides of {:g}, found none", *wanted.iso);
        return mesh;
    }
    const uint16_t label = wanted.label;
    const Volume alone = make_volume(volume.grid(), volume.type(), [&](glm::uvec3 at) {
        return volume.value(at) == label ? static_cast<double>(label) : 0.0;
    });
    const Volume cut = wanted.within.empty() ? alone : labels_within(alone, wanted.within);
    Mesh mesh = surface_of_label(surface_nets(cut, {.passes = kPasses, .stop = stop}), label);
    if (mesh.triangles.empty() && !stop.stop_requested())
        return fail("expected samples of label {}, found none", label);
    return mesh;
}

} // namespace

Volume values_within(const Volume& volume, double iso, std::span<const ClipPlane> planes) {
    const Grid grid = volume.grid();
    const double room = std::max(double{volume.range().max} - iso, 1e-6);
    const double slope = kCutSlope * room / smallest_spacing_mm(grid);
    return make_volume(grid, ScalarType::f32, [&](glm::uvec3 at) {
        const double value = volume.value(at); // NaN stays: data is missing there
        return std::min(iso + slope * depth_of(world_point(grid, glm::dvec3(at)), planes), value);
    });
}

Volume labels_within(const Volume& labels, std::span<const ClipPlane> planes) {
    const Grid grid = labels.grid();
    return make_volume(grid, labels.type(), [&](glm::uvec3 at) {
        return depth_of(world_point(grid, glm::dvec3(at)), planes) >= 0.0 ? double{labels.value(at)}
                                                                          : 0.0;
    });
}

void scale_mesh(Mesh& mesh, double scale) {
    glm::dmat4 larger(scale);
    larger[3][3] = 1.0;
    mesh.world_from_mesh = larger * mesh.world_from_mesh;
}

bool is_watertight(const MeshTopology& found) {
    return found.triangles > 0 && found.closed && found.consistently_oriented &&
           found.non_manifold_edges == 0 && found.degenerate_triangles == 0;
}

std::string watertight_text(const MeshTopology& found) {
    const size_t pieces = found.components.size();
    if (is_watertight(found))
        return fmt::format("watertight, {} piece{}, {} triangles, {:.4g} ml", pieces,
                           pieces == 1 ? "" : "s", found.triangles, 1e-3 * found.volume_mm3);
    return fmt::format(
        "not watertight: {} open edges, {} in more than two triangles, {} misoriented; {} "
        "triangles",
        found.open_edges, found.non_manifold_edges, found.misoriented_edges, found.triangles);
}

Result<MeshExported> make_mesh_export(
    const Volume& volume, const MeshExport& wanted, const std::stop_token& stop,
    const std::function<void(const char* what, double share)>& progress) {
    if (!(wanted.scale > 0.0))
        return fail("a scale: expected a number above 0, found {:g}", wanted.scale);
    // Shares of the time, by the stages that take most of it.
    const auto tell = [&](const char* what, double share) {
        if (progress)
            progress(what, share);
    };
    tell("extracting", 0.0);
    PALPATE_TRY(Mesh mesh, surface_of(volume, wanted, stop));
    if (stop.stop_requested())
        return fail("the export was stopped");
    std::string left_out;
    if (wanted.pieces.largest_only || wanted.pieces.least_mm3 > 0.0) {
        Pieces pieces = keep_pieces(mesh, wanted.pieces);
        if (pieces.kept == 0)
            return fail("expected a piece of {:g} ml or more, found none",
                        1e-3 * wanted.pieces.least_mm3);
        if (pieces.dropped > 0)
            left_out = fmt::format("; {} smaller pieces are left out", pieces.dropped);
        mesh = std::move(pieces.mesh);
    }
    if (wanted.decimate_mm > 0.0) {
        const double most = wanted.wall_mm > 0.0 ? 0.6 : 0.9;
        const auto decimating = [&](double share) {
            tell("removing triangles", 0.1 + (most - 0.1) * share);
        };
        decimating(0.0);
        PALPATE_TRY(
            Decimated found,
            decimate(mesh, {.error_mm = wanted.decimate_mm, .stop = stop, .progress = decimating}));
        mesh = std::move(found.mesh);
    }
    scale_mesh(mesh, wanted.scale);
    if (wanted.wall_mm > 0.0) {
        const auto hollowing = [&](double share) { tell("hollowing", 0.6 + 0.3 * share); };
        hollowing(0.0);
        PALPATE_TRY(
            Shell shell,
            hollowed(mesh, {.wall_mm = wanted.wall_mm, .stop = stop, .progress = hollowing}));
        if (!shell.is_hollow)
            left_out += fmt::format(
                "; no part is thicker than two walls of {:g} mm, so it is solid", wanted.wall_mm);
        mesh = std::move(shell.mesh);
    }
    tell("checking", 0.92);
    const std::string told = watertight_text(topology(mesh)) + left_out;
    if (stop.stop_requested())
        return fail("the export was stopped");
    return MeshExported{std::move(mesh), told};
}

} // namespace palpate
