#include "apps/palpate/surface_print.h"

#include "engine/base/log.h"
#include "engine/mesh/pieces.h"
#include "engine/program/mesh_export.h"
#include "engine/program/option_checks.h"
#include "engine/program/option_texts.h"
#include "engine/surface/shell.h"

namespace palpate {

namespace {

// Several labels share walls: none of them is a body with a wall of its own.
Result<void> expect_one_body(const char* option, const Mesh& mesh) {
    for (const std::vector<uint16_t>* labels : {&mesh.labels, &mesh.outer_labels})
        for (const uint16_t label : *labels)
            if (label != labels->front())
                return fail("{}: expected an iso-value or one label, found several labels", option);
    return {};
}

} // namespace

void add_print_flags(CLI::App& app, PrintFlags& flags) {
    app.add_option("--clip", flags.clips,
                   "Cut by a plane through a point with a normal, px,py,pz,nx,ny,nz in mm (LPS); "
                   "the side of the normal is kept, and the cut is closed; repeatable (default: "
                   "none)")
        ->check(readable(read_clip));
    app.add_flag("--largest", flags.largest_only,
                 "Only the piece that encloses most; hollows in it are filled (default: all)");
    app.add_option("--pieces-from", flags.least_ml,
                   "Leave out pieces, and hollows, that enclose less than this, in ml (default: "
                   "none)")
        ->check(positive())
        ->type_name("ML");
    app.add_option("--scale", flags.scale,
                   "Size of the mesh to that of the patient, after --decimate (default: 1)")
        ->check(positive());
    app.add_option("--wall", flags.wall_mm,
                   "Hollow, with a wall of at least this thickness, in mm after --scale (default: "
                   "solid)")
        ->check(positive())
        ->type_name("MM");
}

Volume cut_for_print(const PrintFlags& flags, const Volume& volume, std::optional<double> iso) {
    std::vector<ClipPlane> planes;
    for (const std::string& text : flags.clips)
        planes.push_back(read_clip(text).value());
    if (planes.empty())
        return volume;
    return iso ? values_within(volume, *iso, planes) : labels_within(volume, planes);
}

Result<Json> choose_pieces(const PrintFlags& flags, Mesh& mesh) {
    const char* option = flags.largest_only ? "--largest" : "--pieces-from";
    PALPATE_TRY(expect_one_body(option, mesh));
    if (const MeshTopology found = topology(mesh); !found.closed)
        return fail("{}: expected a closed surface, found {} open edges: add --closed", option,
                    found.open_edges);
    Pieces pieces =
        keep_pieces(mesh, {.largest_only = flags.largest_only, .least_mm3 = 1e3 * flags.least_ml});
    if (pieces.kept == 0)
        return fail("--pieces-from: expected a piece of {:g} ml or more, found none",
                    flags.least_ml);
    mesh = std::move(pieces.mesh);
    return Json{{"kept", pieces.kept}, {"left_out", pieces.dropped}};
}

Result<Json> shape_for_print(const PrintFlags& flags, Mesh& mesh, const std::stop_token& stop,
                             const std::function<void(double share)>& progress) {
    scale_mesh(mesh, flags.scale);
    Json json{{"scale", flags.scale}};
    if (flags.wall_mm == 0.0)
        return json;
    PALPATE_TRY(expect_one_body("--wall", mesh));
    PALPATE_TRY(Shell shell,
                hollowed(mesh, {.wall_mm = flags.wall_mm, .stop = stop, .progress = progress}));
    if (!shell.is_hollow)
        log::warning("--wall {:g}: no part is thicker than two walls, so the mesh is solid",
                     flags.wall_mm);
    mesh = std::move(shell.mesh);
    json["wall_mm"] = flags.wall_mm;
    json["excess_mm"] = shell.excess_mm;
    json["cell_mm"] = shell.cell_mm;
    json["is_hollow"] = shell.is_hollow;
    return json;
}

} // namespace palpate
