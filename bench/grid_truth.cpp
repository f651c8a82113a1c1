// palpate_grid_truth: what a perfect ray caster would draw, for some pixels of a scene.

#include <CLI/CLI.hpp>

#include "engine/base/log.h"
#include "engine/base/timer.h"
#include "engine/image/exr.h"
#include "engine/io/scene_data.h"
#include "engine/reference/truth.h"

namespace palpate {
namespace {

struct Options {
    std::string scene, output;
    PixelStride pixels;
    std::vector<uint32_t> offset{0, 0};
    int eye = 0;
    bool twin = false;
};

Result<void> run(const Options& options) {
    Result<SceneFile> file = load_scene(options.scene);
    if (!file)
        return pass_on(file);
    Result<LoadedScene> loaded = load_scene_data(*file);
    if (!loaded)
        return pass_on(loaded);
    const Scene scene = resolved_scene(*file, loaded->data.volume.grid());
    PixelStride pixels = options.pixels;
    pixels.offset = {options.offset[0], options.offset[1]};
    if (pixels.offset.x >= scene.size_px.x || pixels.offset.y >= scene.size_px.y)
        return fail("--offset: expected a pixel of the {}x{} picture, found {} {}", scene.size_px.x,
                    scene.size_px.y, pixels.offset.x, pixels.offset.y);
    if (options.eye == 1 && !scene.stereo)
        return fail("{}: --eye 1 asks for a second eye, but the scene has no \"stereo\"",
                    options.scene);
    const Timer timer;
    const auto draw = options.twin ? render_twin : render_truth;
    const Image image = draw(scene, loaded->data, options.eye, pixels);
    log::info("{}x{} rays in {:.1f} s", image.size_px.x, image.size_px.y, timer.ms() / 1000.0);
    return save_exr(options.output, image, ExrPrecision::full_float,
                    {{"palpate:scene", scene_hash(*file)},
                     {"palpate:pixels", fmt::format("every {} from {} {}", pixels.step,
                                                    pixels.offset.x, pixels.offset.y)},
                     {"palpate:renderer", options.twin ? "fp64 twin" : "grid truth"}});
}

} // namespace
} // namespace palpate

int main(int argc, char** argv) {
    CLI::App app("Draws the exact picture of a scene's trilinear field for every S-th pixel.");
    palpate::Options options;
    app.add_option("scene", options.scene, "Scene file (docs/reference/scene.md)")->required();
    app.add_option("-o,--output", options.output, "EXR to write, 32-bit floats")->required();
    app.add_option("--stride", options.pixels.step, "Pixels from one ray to the next")
        ->capture_default_str()
        ->check(CLI::Range(1, 16384));
    app.add_option("--offset", options.offset, "First column and row, in pixels")
        ->expected(2)
        ->capture_default_str();
    app.add_option("--eye", options.eye, "0, or 1 for the right eye of a stereo scene")
        ->capture_default_str()
        ->check(CLI::Range(0, 1));
    app.add_flag("--twin", options.twin,
                 "Draw the ray caster's own algorithm in double instead of the truth");
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    }
    const palpate::Result<void> result = palpate::run(options);
    if (!result)
        palpate::log::error("{}", result.error().message);
    return result ? 0 : 1;
}
