// Jumping over empty space changes no bit of a picture, and is worth it.

#include <cstring>

#include "engine/scene/presets.h"
#include "engine/volume/builder.h"
#include "engine/volume/synthetic.h"
#include "tests/gpu/gpu_fixture.h"

namespace palpate {
namespace {

using namespace synthetic;

// SkippingTest takes over 5 s of a processor: each mode is drawn with and without skipping, by two
// shaders that the CPU driver compiles.
class SkippingTest : public GpuTest {
 protected:
    static SceneData phantom(bool labels) {
        const glm::uvec3 size(121, 128, 60);
        const glm::dvec3 spacing(1.6, 1.5, 3.2);
        const Grid grid = make_grid(size, spacing, -0.5 * (glm::dvec3(size) - 1.0) * spacing);
        SceneData data{sample(ct_phantom(), grid, ScalarType::i16), std::nullopt};
        if (labels)
            data.labels = make_volume(grid, ScalarType::u8, [](glm::uvec3 i) {
                return static_cast<double>((i.x / 20 + i.y / 20 + i.z / 10) % 4);
            });
        return data;
    }

    static Scene scene_of(const SceneData& data, RayMode mode, glm::dvec3 towards) {
        Scene scene;
        scene.size_px = {75, 66}; // no multiple of a tile
        scene.camera = frame_volume(data.volume.grid(), towards, {0, 0, 1});
        scene.value_and_depth = true;
        RayCastLayer layer;
        layer.mode = mode;
        layer.transfer = window_function(150, 1200, 0.2);
        layer.isos = {{-300.0, {0.9, 0.6, 0.5}, 0.4}, {300.0}};
        scene.ray_cast = layer;
        return scene;
    }

    static std::vector<Image> draw(const Scene& scene, const SceneData& data, bool skipping,
                                   uint64_t* samples = nullptr) {
        Renderer renderer = kept_renderer({.skipping = skipping});
        Result<Frame> frame = renderer.render(scene, data);
        EXPECT_TRUE(frame) << frame.error().message;
        if (samples)
            *samples = renderer.count_samples(scene, data).value();
        return std::move(frame->eyes);
    }

    static void expect_same_bits(const Scene& scene, const SceneData& data) {
        const std::vector<Image> with = draw(scene, data, true);
        const std::vector<Image> without = draw(scene, data, false);
        ASSERT_EQ(with.size(), without.size());
        double visible = 0;
        for (size_t eye = 0; eye < with.size(); ++eye) {
            const auto& a = with[eye].samples;
            const auto& b = without[eye].samples;
            ASSERT_EQ(a.size(), b.size());
            size_t differing = 0;
            for (size_t i = 0; i < a.size(); ++i)
                differing += std::memcmp(&a[i], &b[i], sizeof a[i]) != 0;
            EXPECT_EQ(differing, 0u);
            for (uint32_t y = 0; y < scene.size_px.y; ++y)
                for (uint32_t x = 0; x < scene.size_px.x; ++x)
                    visible += with[eye].at(x, y, 3) > 0.0f;
        }
        EXPECT_GT(visible, 100.0); // the comparison means something
    }
};

const glm::dvec3 kSkippingViews[] = {{-0.45, -1.0, 0.4}, {0, -1, 0}, {1, 0, 0}, {0.02, 0.1, -1.0}};

TEST_F(SkippingTest, EveryModeGivesTheSameBits) {
    const SceneData data = phantom(false);
    for (const glm::dvec3 view : kSkippingViews)
        for (const RayMode mode : {RayMode::mip, RayMode::alpha, RayMode::iso}) {
            SCOPED_TRACE(testing::Message() << "mode " << static_cast<int>(mode) << " view "
                                            << view.x << " " << view.y << " " << view.z);
            Scene scene = scene_of(data, mode, view);
            expect_same_bits(scene, data);
            scene.ray_cast->integrator = Integrator::exact;
            expect_same_bits(scene, data);
        }
}

TEST_F(SkippingTest, EveryIntegratorAndShadingGivesTheSameBits) {
    const SceneData data = phantom(false);
    for (const double step : {0.4, 1.5, 7.0}) // beyond a cell's side of 4 samples, too
        for (const Integrator integrator :
             {Integrator::fast, Integrator::preintegrated, Integrator::exact})
            for (const bool shaded : {false, true}) {
                SCOPED_TRACE(testing::Message()
                             << "step " << step << " integrator " << static_cast<int>(integrator)
                             << " shaded " << shaded);
                Scene scene = scene_of(data, RayMode::alpha, kSkippingViews[0]);
                scene.ray_cast->integrator = integrator;
                scene.ray_cast->step_mm = step;
                if (shaded)
                    scene.ray_cast->shading = Shading{};
                expect_same_bits(scene, data);
            }
}

TEST_F(SkippingTest, LabelsClipsSlicesAndStereoGiveTheSameBits) {
    const SceneData data = phantom(true);
    for (const RayMode mode : {RayMode::mip, RayMode::alpha, RayMode::iso}) {
        SCOPED_TRACE(static_cast<int>(mode));
        Scene scene = scene_of(data, mode, kSkippingViews[0]);
        scene.labels = LabelLayer{};
        scene.labels->styles = {{}, {{1, 0, 0}, true}, {{0, 1, 0}, false}};
        scene.clip_planes = {{{10, 0, 0}, {1, 0.3, 0}}};
        scene.slices = {{{0, 0, -20}, {0, 0, 1}}};
        scene.slice_transfer = window_function(-1000, 1000, 1.0);
        scene.stereo = StereoSettings{};
        expect_same_bits(scene, data);
        scene.ray_cast->integrator = Integrator::exact;
        expect_same_bits(scene, data);
    }
}

TEST_F(SkippingTest, TakesAFractionOfTheSamples) {
    const SceneData data = phantom(false);
    for (const auto& [mode, most] :
         {std::pair(RayMode::alpha, 0.6), std::pair(RayMode::iso, 0.5)}) {
        Scene scene = scene_of(data, mode, kSkippingViews[0]);
        for (const Integrator integrator : {Integrator::fast, Integrator::exact}) {
            scene.ray_cast->integrator = integrator;
            uint64_t with = 0, without = 0;
            draw(scene, data, true, &with);
            draw(scene, data, false, &without);
            EXPECT_GT(with, 0u);
            EXPECT_LT(static_cast<double>(with), most * static_cast<double>(without))
                << static_cast<int>(mode);
        }
    }
}

// A wide slab of smooth hills. Where a tile's rays lie farther apart than the cells of the map
// there is nothing to pass over, and the rays do not ask.
TEST_F(SkippingTest, AMipGivesTheSameBitsFromFewerSamplesWherePixelsAreSmall) {
    const glm::uvec3 size(260, 255, 40);
    const SceneData data{make_volume(make_grid(size, glm::dvec3(1.0)), ScalarType::u16,
                                     [](glm::uvec3 i) {
                                         const auto hill = [](uint32_t x, uint32_t period) {
                                             const uint32_t r = x % period;
                                             return std::min(r, period - r);
                                         };
                                         return static_cast<double>(hill(i.x, 97) * hill(i.y, 131) *
                                                                    (2 + hill(i.z, 23)));
                                     }),
                         std::nullopt};
    for (const glm::dvec3 view : {glm::dvec3(0.3, -1.0, 0.2), {1, 0, 0}}) { // along the slab
        Scene scene = scene_of(data, RayMode::mip, view);
        scene.ray_cast->transfer = window_function(0, 40000, 1.0);
        for (const uint32_t side : {32, 200}) {
            scene.size_px = {side, side};
            expect_same_bits(scene, data);
            uint64_t with = 0, without = 0;
            draw(scene, data, true, &with);
            draw(scene, data, false, &without);
            if (side < 100)
                EXPECT_EQ(with, without);
            else
                EXPECT_LT(with, without);
        }
    }
}

// A brute-force MIP takes one sample a segment: the counter is not just any number.
TEST_F(SkippingTest, CountsEverySampleOfAPlainMip) {
    const SceneData data = phantom(false);
    const Scene scene = scene_of(data, RayMode::mip, kSkippingViews[0]);
    uint64_t samples = 0;
    draw(scene, data, false, &samples);
    const auto segments = static_cast<double>(count_segments(scene, data.volume.grid()));
    // Rounding may move the end of a ray into the next segment of the lattice.
    EXPECT_NEAR(static_cast<double>(samples), segments, 75.0 * 66.0);
}

} // namespace
} // namespace palpate
