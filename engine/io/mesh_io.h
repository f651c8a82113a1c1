#pragma once

#include <cstdint>
#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/memory.h"
#include "engine/mesh/mesh.h"

namespace palpate {

struct MeshWriteOptions {
    bool ascii = false; // of .ply and .stl; else binary, little endian
    std::stop_token stop;
};

// Writes a mesh in the format its extension names: .ply, .stl, .obj or .vtp. Positions are world
// millimetres (LPS); triangles are counter-clockwise seen from outside in the world too, so where
// world_from_mesh mirrors, they are turned over.
//
//        normals     labels, outer labels                         numbers
//   PLY  vertex      face properties "label", "outer_label"       float or double
//   VTP  point data  cell data "label", "outer_label"             Float32 or Float64
//   OBJ  vn          a group "label_N" or "label_N_M" a label     text
//   STL  of facets   none                                         float
//
// All state SPACE=LPS as 3D Slicer does: in the header of STL, a comment of PLY and OBJ, and the
// field data of VTP.
//
// float where it holds every coordinate to 1e-4 mm, double where it does not; STL, which has floats
// alone, is refused where they are off by more than 0.01 mm. A mesh of a position that is not
// finite is refused by all.
//
// The file appears whole or not at all, also when `stop` asks to end early.
Result<void> save_mesh(const std::filesystem::path& path, const Mesh& mesh,
                       const MeshWriteOptions& options = {});

struct MeshReadOptions {
    // Upper bound for the file's contents, the mesh made from them, and what making it takes.
    uint64_t max_memory_bytes = physical_memory_bytes() / 2;
};

// A mesh read from a file, with messages for people.
struct LoadedMesh {
    Mesh mesh;
    std::vector<std::string> warnings;
};

// Reads a mesh. The format is recognised by the first bytes, or by the extension where those are
// ambiguous. Polygons are cut into fans.
//
//   PLY  ascii, and binary of either byte order; any types
//   STL  binary or ascii; corners of equal position become one vertex
//   OBJ  polygons with positive or negative indices; normals where all corners of a vertex name the
//        same one; texture coordinates and materials are passed over; free-form surfaces are
//        refused
//   VTP  polygons and triangle strips of all pieces, as text, base64 or appended, packed by zlib or
//        not
//
//   X3D  the shapes of a scene (x3d.h), in mm; each material is a label
//
// Points and lines are left out with a warning.
//
// Positions are world millimetres, LPS unless the file states SPACE=RAS as 3D Slicer does, which is
// turned to LPS. Where they lie too far off for floats, world_from_mesh holds the offset, a whole
// number of millimetres. Normals are kept where every vertex has one, and labels where every face
// has one.
//
// Everything a header claims is held against the file's length before memory is taken for it. An
// error is one sentence that names the file, what was expected and what was found.
Result<LoadedMesh> load_mesh(const std::filesystem::path& path,
                             const MeshReadOptions& options = {});

// Whether a path ends as a mesh's does: .ply, .stl, .obj, .vtp.
bool has_mesh_extension(const std::filesystem::path& path);

} // namespace palpate
