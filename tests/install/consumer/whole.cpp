// Uses a part of each layer by the header of everything.

#include <cstdio>

#include "engine/palpate.h"

int main() {
    using namespace palpate;
    const Volume volume = make_synthetic("synthetic:ball?size=16", 1 << 30).value();
    const Mesh mesh = marching_cubes(volume, 500.0f);
    Scene scene;
    scene.camera = frame_volume(volume.grid(), {0, -1, 0}, {0, 0, 1});
    std::printf("%zu triangles, %zu filters, %zu touch algorithms\n", mesh.triangles.size(),
                filters().size(), haptics::algorithms().size());
    return mesh.triangles.empty() || filters().empty() || haptics::algorithms().empty();
}
