#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <stop_token>
#include <string>

#include "engine/base/error.h"
#include "engine/mesh/mesh.h"
#include "engine/mesh/pieces.h"
#include "engine/mesh/topology.h"
#include "engine/scene/scene.h"
#include "engine/volume/volume.h"

namespace palpate {

// A surface for print, and how it is made: extracted, cut, chosen, made simpler, scaled, hollowed.
struct MeshExport {
    std::optional<double> iso; // where values pass it, closed at the volume's border; else
    uint16_t label = 1;        // the surface of a label, smoothed within 0.375 of a sample
    std::vector<ClipPlane> within;
    PieceChoice pieces;
    double decimate_mm = 0.0; // no point moves farther; 0: all triangles stay
    double scale = 1.0;       // > 0, of the print to the patient
    double wall_mm = 0.0;     // of the print; 0: it is solid

    friend bool operator==(const MeshExport&, const MeshExport&) = default;
};

struct MeshExported {
    Mesh mesh;
    std::string told; // "watertight, 1 piece, 12345 triangles, 52.3 ml"
};

// Makes it of values, or of labels. `progress` is told what is done, and a share of all of it.
// An error where there is no such surface, or it was asked to stop.
Result<MeshExported> make_mesh_export(
    const Volume& volume, const MeshExport& wanted, const std::stop_token& stop = {},
    const std::function<void(const char* what, double share)>& progress = {});

// Watertight: closed, each edge in two triangles that run along it both ways. Else what is wrong.
bool is_watertight(const MeshTopology& found);
std::string watertight_text(const MeshTopology& found);

// The values, or labels, whose surface is cut by planes, and closed at the cuts: each is where it
// should be to the size of a sample. Of labels, samples beyond a plane become 0.
Volume values_within(const Volume& volume, double iso, std::span<const ClipPlane> planes);
Volume labels_within(const Volume& labels, std::span<const ClipPlane> planes);

void scale_mesh(Mesh& mesh, double scale); // about the world's origin

} // namespace palpate
