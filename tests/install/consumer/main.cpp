// Makes a CT phantom, carves into it, writes it and reads it back, and draws it twice: with Vulkan,
// and with the CPU reference.
//
//   consumer <folder to write into>

#include <cmath>
#include <cstdio>
#include <filesystem>

#include "engine/base/error.h"
#include "engine/gpu/device.h"
#include "engine/image/png.h"
#include "engine/io/sandbox.h"
#include "engine/io/volume_io.h"
#include "engine/reference/twin.h"
#include "engine/render/renderer.h"
#include "engine/scene/presets.h"
#include "engine/volume/bspline.h"
#include "engine/volume/changes.h"
#include "engine/volume/edit.h"
#include "engine/volume/synthetic.h"

using namespace palpate;

namespace {

Volume carved(const Volume& volume) {
    VolumeEdit edit(volume);
    for (uint32_t z = 40; z < 64; ++z)
        for (uint32_t y = 0; y < 32; ++y)
            for (uint32_t x = 20; x < 32; ++x)
                edit.set({x, y, z}, -1000.0);
    return edit.commit();
}

Result<void> run(const std::filesystem::path& folder) {
    const Grid grid = make_grid(glm::uvec3(64), glm::dvec3(3.2), glm::dvec3(-100.0));
    const Volume head = synthetic::sample_ct_phantom(grid);
    const Volume volume = carved(head);
    std::printf("carving changed %zu bricks\n", changed_bricks(head, volume).size());
    const SmoothSample sample = SmoothCursor(volume).sample({40.5, 50.0, 33.0});
    std::printf("inside: %.0f HU\n", sample.value);

    const std::filesystem::path file = folder / "head.nii.gz";
    PALPATE_TRY(save_volume(file, volume));
    PALPATE_TRY(const LoadedVolume loaded, load_volume(file));
    if (!changed_bricks(volume, loaded.volume).empty())
        return fail("{}: expected the voxels that were written, found others", file.string());

    Scene scene;
    scene.size_px = {96, 96};
    scene.camera = frame_volume(grid, {-0.45, -1.0, 0.4}, {0, 0, 1});
    scene.ray_cast.emplace();
    scene.ray_cast->transfer = *preset("ct-bone");
    const SceneData data{loaded.volume, {}};
    const Image truth = render_twin(scene, data);
    GpuDevice device(DeviceOptions{});
    PALPATE_TRY(const Frame frame, Renderer(device).render(scene, data));
    const Image& picture = frame.eyes.at(0);

    double squares = 0.0, light = 0.0;
    for (uint32_t y = 0; y < 96; ++y)
        for (uint32_t x = 0; x < 96; ++x) {
            const double difference = picture.at(x, y, 0) - truth.at(x, y, 0);
            squares += difference * difference;
            light += truth.at(x, y, 0);
        }
    const double rmse = std::sqrt(squares / (96.0 * 96.0)), mean = light / (96.0 * 96.0);
    std::printf("%s: mean red %.3f, differs from the reference by %.5f\n",
                device.info().name.c_str(), mean, rmse);
    if (!(mean > 0.05 && rmse < 0.1 * mean))
        return fail("expected a picture like the reference's");
    return save_png(folder / "head.png", picture);
}

} // namespace

int main(int argc, char** argv) {
    if (argc != 2)
        return 2;
    std::printf("decoder: %s\n", io::decoder_program().c_str());
    const Result<void> result = run(argv[1]);
    if (!result)
        std::fprintf(stderr, "%s\n", result.error().message.c_str());
    return result ? 0 : 1;
}
