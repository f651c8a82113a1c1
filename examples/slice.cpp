// Draws the middle slice of a volume: of a file, a DICOM folder, or anything else that Palpate
// reads.
//
//     example_slice head.nii.gz slice.png

#include <cstdio>
#include <exception>

#include "engine/gpu/device.h"
#include "engine/image/png.h"
#include "engine/io/volume_io.h"
#include "engine/render/renderer.h"
#include "engine/session/default_scene.h"

using namespace palpate;

Result<void> draw(const char* file, const char* picture) {
    const Result<LoadedVolume> loaded = load_volume(file); // decoded by the program palpate
    if (!loaded)
        return fail("{}", loaded.error().message);
    const Volume& volume = loaded->volume;
    const Grid& grid = volume.grid();
    const ValueRange range = volume.range();
    const glm::dvec3 spacing = spacing_mm(grid);
    std::printf("%u x %u x %u samples, %g x %g x %g mm, values %g .. %g\n", grid.size.x,
                grid.size.y, grid.size.z, spacing.x, spacing.y, spacing.z, double(range.min),
                double(range.max));

    // Across the patient's axis, seen from the feet as radiologists do: the nose is up.
    const double across_mm = glm::length(glm::dmat3(grid.world_from_index) * glm::dvec3(grid.size));
    Scene scene;
    scene.size_px = {256, 256};
    scene.slices = {{.point_mm = center_mm(grid), .normal = {0, 0, 1}}};
    const LoadedScene told{.data = {volume, {}, {}}, .modality = loaded->modality};
    scene.slice_transfer = default_slice_transfer(told); // soft tissue for CT
    scene.camera = {.projection = Projection::orthographic,
                    .eye_mm = center_mm(grid) - glm::dvec3(0, 0, across_mm),
                    .target_mm = center_mm(grid),
                    .up = {0, -1, 0},
                    .view_height_mm = across_mm};

    GpuDevice device(DeviceOptions{});
    Renderer renderer(device);
    const Result<Frame> frame = renderer.render(scene, told.data);
    if (!frame)
        return fail("{}", frame.error().message);
    return save_png(picture, frame->eyes.at(0));
}

int main(int argc, char** argv) try {
    if (argc != 3) {
        std::fprintf(stderr, "usage: example_slice VOLUME PICTURE.png\n");
        return 2;
    }
    const Result<void> done = draw(argv[1], argv[2]);
    if (!done)
        std::fprintf(stderr, "%s\n", done.error().message.c_str());
    return done ? 0 : 1;
} catch (const std::exception& failure) { // GpuError: no device, out of memory, device lost
    std::fprintf(stderr, "%s\n", failure.what());
    return 1;
}
