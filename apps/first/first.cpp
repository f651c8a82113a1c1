// Draws bone of a CT, with the libraries that read and draw alone: scripts/demo has a picture while
// the rest of the program is compiled. The camera is that of `palpate render --view oblique`.
//
//     palpate-first VOLUME PICTURE.png

#include <cstdio>
#include <exception>
#include <string_view>

#include "engine/decode/serve.h"
#include "engine/gpu/device.h"
#include "engine/image/png.h"
#include "engine/io/sandbox.h"
#include "engine/io/volume_io.h"
#include "engine/render/renderer.h"

namespace palpate {
namespace {

Result<void> draw_bone(const char* volume, const char* picture) {
    PALPATE_TRY(const LoadedVolume loaded, load_volume(volume));
    Scene scene;
    scene.size_px = {512, 512};
    scene.camera = frame_volume(loaded.volume.grid(), {-0.45, -1.0, 0.4}, {0, 0, 1}, 0.65);
    scene.ray_cast.emplace();
    scene.ray_cast->mode = RayMode::iso;
    scene.ray_cast->isos = {{.value = 300.0}};
    scene.ray_cast->shading.emplace();
    GpuDevice device(DeviceOptions{});
    Renderer renderer(device);
    PALPATE_TRY(const Frame frame, renderer.render(scene, {loaded.volume, {}, {}}));
    return save_png(picture, frame.eyes.at(0)); // behind the bone it is transparent
}

} // namespace
} // namespace palpate

int main(int argc, char** argv) try {
    if (argc > 1 && std::string_view(argv[1]) == "__decode") // a child of load_volume()
        palpate::io::serve_decoding(argc, argv);
    if (argc != 3) {
        std::fprintf(stderr, "usage: palpate-first VOLUME PICTURE.png\n");
        return 2;
    }
    palpate::io::set_decoder_program("/proc/self/exe");
    const palpate::Result<void> done = palpate::draw_bone(argv[1], argv[2]);
    if (!done)
        std::fprintf(stderr, "%s\n", done.error().message.c_str());
    return done ? 0 : 1;
} catch (const std::exception& failure) { // GpuError: no device, out of memory, device lost
    std::fprintf(stderr, "%s\n", failure.what());
    return 1;
}
