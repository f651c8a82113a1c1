// Extracts a surface, checks it, and writes it as a mesh file.
//
//     example_mesh torus.ply

#include <cstdio>

#include "engine/io/mesh_io.h"
#include "engine/mesh/topology.h"
#include "engine/surface/marching_cubes.h"
#include "engine/volume/synthetic.h"

using namespace palpate;

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: example_mesh MESH.ply (or .stl, .obj, .vtp)\n");
        return 2;
    }
    // A torus of tube radius 8 mm about a ring of radius 20 mm; values are mm to its surface. A
    // volume from a file: load_volume() of engine/io/volume_io.h.
    const Grid grid = make_grid({120, 120, 48}, glm::dvec3(0.5), {-29.75, -29.75, -11.75});
    const Volume volume =
        synthetic::sample(synthetic::torus({0, 0, 0}, 20.0, 8.0), grid, ScalarType::f32);

    const Mesh mesh = marching_cubes(volume, 0.0f);
    const MeshTopology found = topology(mesh);
    std::printf("triangles %llu, closed %s, Euler number %lld, volume %.1f mm^3\n",
                static_cast<unsigned long long>(found.triangles), found.closed ? "yes" : "no",
                static_cast<long long>(found.euler_number), found.volume_mm3);

    const Result<void> saved = save_mesh(argv[1], mesh);
    if (!saved) {
        std::fprintf(stderr, "%s\n", saved.error().message.c_str());
        return 1;
    }
    return 0;
}
