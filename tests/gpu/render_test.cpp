#include <cmath>

#include "engine/base/timer.h"
#include "engine/volume/builder.h"
#include "engine/volume/edit.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

Volume ball(ScalarType type = ScalarType::i16) {
    return make_volume(make_grid({64, 64, 40}, {1.0, 1.0, 1.6}), type, [](glm::uvec3 i) {
        const glm::dvec3 p = (glm::dvec3(i) - glm::dvec3(31.5, 31.5, 19.5)) * glm::dvec3(1, 1, 1.6);
        return 1000.0 - 40.0 * glm::length(p);
    });
}

Scene scene_of(const Volume& volume, RayMode mode) {
    Scene scene;
    scene.size_px = {96, 80};
    scene.camera = frame_volume(volume.grid(), {0.3, -1.0, 0.4}, {0, 0, 1});
    scene.background = {0.1, 0.2, 0.3};
    RayCastLayer layer;
    layer.mode = mode;
    layer.transfer = window_function(0.0, 1000.0, mode == RayMode::mip ? 1.0 : 0.1);
    layer.isos = {{300.0}};
    if (mode == RayMode::iso)
        layer.shading = Shading{};
    scene.ray_cast = layer;
    return scene;
}

class RenderTest : public GpuTest {};

TEST_F(RenderTest, EveryModeShowsTheBallInTheMiddleAndBackgroundInTheCorner) {
    const SceneData data{ball(), std::nullopt};
    Renderer renderer(device());
    for (const RayMode mode : {RayMode::mip, RayMode::alpha, RayMode::iso}) {
        const Scene scene = scene_of(data.volume, mode);
        const Result<Frame> frame = renderer.render(scene, data);
        ASSERT_TRUE(frame) << frame.error().message;
        const Image& image = frame->eyes.at(0);
        EXPECT_EQ(image.at(0, 0, 3), 0.0f);
        EXPECT_FLOAT_EQ(image.at(0, 0, 0), 0.1f);
        EXPECT_GT(image.at(48, 40, 3), 0.5f);
        EXPECT_GT(image.at(48, 40, 0), 0.3f);
    }
}

TEST_F(RenderTest, OneEditUploadsOneBrick) {
    const Volume before = ball();
    Renderer renderer(device());
    const Scene scene = scene_of(before, RayMode::alpha);
    EXPECT_EQ(renderer.draw(scene, {before, std::nullopt})->uploaded_bricks, 8u);
    VolumeEdit edit(before);
    edit.set({40, 40, 10}, -1000.0);
    EXPECT_EQ(renderer.draw(scene, {edit.commit(), std::nullopt})->uploaded_bricks, 1u);
}

} // namespace
} // namespace palpate
