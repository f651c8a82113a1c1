// Draws a picture of numbers in memory: a ball with a hole, as a shaded surface.
//
//     example_picture ball.png

#include <cstdio>
#include <exception>
#include <vector>

#include "engine/gpu/device.h"
#include "engine/image/png.h"
#include "engine/render/renderer.h"
#include "engine/volume/builder.h"

using namespace palpate;

// Samples in memory order: x fastest, then y, then z. They lie 1 mm apart in x and y, 2 mm in z.
Volume numbers_in_memory() {
    const glm::uvec3 size(96, 96, 48);
    const Grid grid = make_grid(size, {1.0, 1.0, 2.0}, {-47.5, -47.5, -47.0});
    std::vector<float> samples;
    samples.reserve(sample_count(grid));
    for (uint32_t z = 0; z < size.z; ++z)
        for (uint32_t y = 0; y < size.y; ++y)
            for (uint32_t x = 0; x < size.x; ++x) {
                const glm::dvec3 p = world_point(grid, {x, y, z});
                const double inside_ball = 40.0 - glm::length(p);                     // mm
                const double outside_hole = glm::length(glm::dvec2(p.x, p.z)) - 12.0; // mm
                samples.push_back(static_cast<float>(glm::min(inside_ball, outside_hole)));
            }
    return make_volume<float>(grid, samples);
}

int main(int argc, char** argv) try {
    if (argc != 2) {
        std::fprintf(stderr, "usage: example_picture PICTURE.png\n");
        return 2;
    }
    const Volume volume = numbers_in_memory();

    Scene scene;
    scene.size_px = {256, 256};
    // Seen from in front of the patient and a little from the left and above.
    scene.camera = frame_volume(volume.grid(), {0.4, -1.0, 0.3}, {0, 0, 1});
    scene.ray_cast.emplace();
    scene.ray_cast->mode = RayMode::iso;
    scene.ray_cast->isos = {{.value = 0.0}};

    GpuDevice device(DeviceOptions{}); // a graphics card, or Mesa's lavapipe
    Renderer renderer(device);
    const Result<Frame> frame = renderer.render(scene, {volume, {}, {}});
    if (!frame) {
        std::fprintf(stderr, "%s\n", frame.error().message.c_str());
        return 1;
    }
    const Result<void> saved = save_png(argv[1], frame->eyes.at(0));
    if (!saved) {
        std::fprintf(stderr, "%s\n", saved.error().message.c_str());
        return 1;
    }
    std::printf("%s: drawn by %s\n", argv[1], device.info().name.c_str());
    return 0;
} catch (const std::exception& failure) { // GpuError: no device, out of memory, device lost
    std::fprintf(stderr, "%s\n", failure.what());
    return 1;
}
